"""Bodies with frames at their nodes: beams, rigid bodies, and beams glued to shells."""
