"""Error estimates of results, from coarser runs of the same scene."""
