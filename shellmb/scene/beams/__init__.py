"""Beams: curves and sections."""
