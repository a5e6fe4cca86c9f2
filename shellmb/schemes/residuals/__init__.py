"""Residuals of a step: rows and weights, of which every scheme is made."""
