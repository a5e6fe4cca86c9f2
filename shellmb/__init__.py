"""Geometrically exact shells in flexible multibody dynamics, on DOLFINx.

Importing this package imports nothing heavy: `shellmb.scene` and `shellmb.forms` are usable
without DOLFINx, which is loaded by `shellmb.build` and what follows it.
"""

__version__ = "0.1.0"
