"""Differences of fourth order, where derivatives are not written."""

# places beside the middle, in distances, and their weights in a derivative, over the distance
FOURTH = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))
