"""Loads, supports and prescribed motions."""
