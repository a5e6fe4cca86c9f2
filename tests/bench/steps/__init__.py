"""Times of steps in pairs: this checkout beside another one."""
