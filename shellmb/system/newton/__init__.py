"""Newton's method: DOLFINx's solver or PETSc's SNES around our linear solution."""
