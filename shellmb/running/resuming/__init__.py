"""Going on with a run where it stopped."""
