"""Time schemes: at which states the forms are taken, and with which weights."""

# before any of these is used, whichever module of this package is imported first
import shellmb.libraries  # noqa: F401
