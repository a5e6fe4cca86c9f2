"""Adjoint: derivatives of one number by many parameters, by one sweep backwards through the run."""
