"""Costs of the solver on this machine, part by part, and beside other codes."""

import os

# a process that keeps no byte code compiles all of its Python anew: a third of a short command
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
