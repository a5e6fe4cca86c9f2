"""What a run directory holds, read back and shown: fields, plots, pictures in space, pages."""
