"""Motions in several codes."""
