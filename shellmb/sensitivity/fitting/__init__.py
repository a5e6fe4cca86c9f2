"""What derivatives are for: fits to measurements, error bands, rankings of parameters."""
