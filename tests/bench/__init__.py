"""What the solver costs on this machine, part by part, and against other codes."""
