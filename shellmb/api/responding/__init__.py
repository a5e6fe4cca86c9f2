"""Linear systems about any state, and their response: harmonic, random, by base motion, shock."""

# before any of these is used, whichever module of this package is imported first
import shellmb.libraries  # noqa: F401
