"""Places on bodies by edge, name or coordinates, and the ends that act there."""
