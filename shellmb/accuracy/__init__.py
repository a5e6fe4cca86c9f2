"""Error estimates of results, from coarser companions of a run."""
