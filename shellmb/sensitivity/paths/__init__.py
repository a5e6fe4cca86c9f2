"""Derivatives of static paths: of their points, limit loads and bifurcation loads."""
