"""An accuracy on request: levels of mesh and step until an error is met, and what they cost."""
