"""What joints hold, what acts on their coordinates, and their rows over a step."""
