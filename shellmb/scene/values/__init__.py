"""Building blocks of a scene: checked dataclasses, functions of time and of position."""
