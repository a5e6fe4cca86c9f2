"""Sensitivities: exact derivatives of a run by parameters of its scene, fits and error bands."""
