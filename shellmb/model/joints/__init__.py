"""Joints and their coordinates."""
