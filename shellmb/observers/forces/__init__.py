"""What joints, drivers and supports carry."""
