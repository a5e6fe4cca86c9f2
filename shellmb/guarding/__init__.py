"""A process among others: its libraries' options, signals, streams and permissions."""
