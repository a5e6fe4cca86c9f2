"""Checks of a run that warn of unreliable results: one file per idea, all of them in `registry`."""

# before any of these is used, whichever module of this package is imported first
import shellmb.libraries  # noqa: F401
