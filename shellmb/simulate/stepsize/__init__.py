"""The size of a step: halved and grown, by its error, and times to land on."""
