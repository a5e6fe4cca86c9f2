"""Mechanisms in several codes, with exact motions."""
