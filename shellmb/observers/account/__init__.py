"""The balance of a step: energies, momenta, constraints."""
