"""Controllers and events in a run: readings, samples, and steps that end at events."""
