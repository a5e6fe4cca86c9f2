"""What a run decides for itself: sensors, controllers with their commands, and events."""
