"""Bundled scenes; each one is a script that a user can copy and change."""
