"""The library of loops in C: compiler, flags, cache."""
