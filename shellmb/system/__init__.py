"""Block assembly, Newton's method and eigenvalue problems; knows no shells."""

# before any of these is used, whichever module of this package is imported first
import shellmb.libraries  # noqa: F401
