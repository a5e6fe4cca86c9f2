"""Direct solutions of linear systems, and what their pivots tell."""
