"""Sections of bodies bound to meshes, and the damping that goes with them."""
