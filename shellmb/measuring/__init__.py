"""One way to measure, record, tabulate and draw, for bench, study, effects, verify and figures."""
