"""Supports, prescribed motions, and loads at points."""
