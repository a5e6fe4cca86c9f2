"""Rigid bodies and own ones, joints, and what couples, drives and resists their coordinates."""
