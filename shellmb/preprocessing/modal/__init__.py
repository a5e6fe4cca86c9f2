"""Bodies reduced to modes: found from the model of each body alone, before the run."""
