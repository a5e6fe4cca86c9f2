"""One method to measure, record, tabulate and draw, for all that compares and measures."""
