"""From forms and spaces to the energies and forces of a scene's bodies."""

# before any of these is used, whichever module of this package is imported first
import shellmb.libraries  # noqa: F401
