"""Decisions of a run: sensors, controllers with their commands, and events."""
