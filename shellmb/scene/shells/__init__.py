"""Shells: surfaces, sections, laminates, and the joins between shells."""
