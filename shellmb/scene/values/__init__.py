"""What parts of a scene are made of: checked dataclasses, functions of time and of position."""
