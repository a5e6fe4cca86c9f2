"""All effects, by what they are about."""
