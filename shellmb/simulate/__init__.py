"""The loop over load or time steps: step control, retries, restart; knows no physics."""

# before any of these is used, whichever module of this package is imported first
import shellmb.libraries  # noqa: F401
