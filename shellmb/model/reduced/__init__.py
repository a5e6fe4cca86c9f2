"""Bodies reduced to modes about a floating frame."""
