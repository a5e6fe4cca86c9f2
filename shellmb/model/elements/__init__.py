"""Force elements: springs, dampers, stops and motors on their coordinates."""
