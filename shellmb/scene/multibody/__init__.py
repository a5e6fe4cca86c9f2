"""Rigid bodies, joints, and what drives and resists their coordinates."""
