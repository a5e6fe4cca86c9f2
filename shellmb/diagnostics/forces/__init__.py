"""Watches of what joints, drivers and contacts carry."""
