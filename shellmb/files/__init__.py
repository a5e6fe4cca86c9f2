"""Files of others and of ours: read within limits, written whole, locked, with checksums."""
