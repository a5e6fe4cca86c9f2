"""Natural modes: found of a scene, and runs that write them."""

# before any of these is used, whichever module of this package is imported first
import shellmb.libraries  # noqa: F401
