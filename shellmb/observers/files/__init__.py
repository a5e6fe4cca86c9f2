"""Files of a run: snapshots, checkpoints, growing tables."""
