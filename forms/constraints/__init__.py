"""Constraints of joints, forces on their coordinates, and their rows over a step."""
