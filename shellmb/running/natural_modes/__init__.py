"""Natural modes: found of a scene, and runs that write them."""
