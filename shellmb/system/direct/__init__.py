"""Direct solutions of linear systems, and information from their pivots."""
