"""Static problems in several codes."""
