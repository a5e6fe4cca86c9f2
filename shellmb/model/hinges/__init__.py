"""Hinges along edges of shells: their points, frames and angles."""
