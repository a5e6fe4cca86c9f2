"""Sensitivities: exact derivatives of a run by parameters of its scene, fits and error bands."""

# before any of these is used, whichever module of this package is imported first
import shellmb.libraries  # noqa: F401
