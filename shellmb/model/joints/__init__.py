"""Joints, their coordinates, and the forces that act on these."""
