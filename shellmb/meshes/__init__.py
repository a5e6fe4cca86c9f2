"""From a scene to meshes, tags, function spaces and states."""

# before any of these is used, whichever module of this package is imported first
import shellmb.libraries  # noqa: F401
