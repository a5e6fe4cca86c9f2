"""Costs of accuracy in time: sweeps of a scene against a reference (`shellmb study`)."""
