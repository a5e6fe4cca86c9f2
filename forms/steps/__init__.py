"""A step in time: averages, paths, and the internal virtual work over them."""
