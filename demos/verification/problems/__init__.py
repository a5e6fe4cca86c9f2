"""The verification cases, by subject."""
