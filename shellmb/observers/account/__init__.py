"""The account of a step: energies, momenta, constraints."""
