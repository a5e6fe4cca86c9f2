"""Static paths through limit points and bifurcations."""
