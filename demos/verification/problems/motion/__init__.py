"""Verification of shells in motion: large rotations, flights, and what loads leave behind."""
