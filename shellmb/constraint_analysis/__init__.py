"""Whether a model can be solved: redundant constraints, and what nothing holds."""
