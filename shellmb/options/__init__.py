"""Options of runs and studies, described once for the command line and for Python."""
