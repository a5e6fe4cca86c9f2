"""Schemes of others, for comparison."""
