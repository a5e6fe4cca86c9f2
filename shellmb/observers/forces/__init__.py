"""Forces of joints, drivers and supports."""
