"""Closed-form solutions of plates, strips and beams that verification compares with."""
