"""`python -m shellmb.cli`, the same as `shellmb`."""

from shellmb.cli import app

app()
