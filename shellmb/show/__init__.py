"""Content of a run directory, read back and shown: fields, plots, pictures in space, pages."""
