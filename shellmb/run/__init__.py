"""Runs of scenes: loading, options, the run directory, and going on after a stop."""

from shellmb.calling import callable_module

callable_module(__name__, "shellmb.api.runs:run")
