"""Stages in which a model is made, each of which returns what it made."""
