"""What accuracy costs in time: sweeps of a scene against a reference (`shellmb study`)."""
