"""Closed forms and published values that bundled scenes compare with."""
