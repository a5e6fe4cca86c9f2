"""Watches of what elements cannot follow: directors far apart, distorted ones that lock."""
