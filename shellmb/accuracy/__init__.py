"""Errors beside results: coarser companions of a run tell how far it is from the limit."""
