"""Costs of the solver on this machine, part by part, and beside other codes."""
