"""The paper's three examples."""
