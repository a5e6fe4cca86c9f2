"""Watches of loads, and of what joints, drivers and contacts carry."""
