"""Uses of derivatives: fits to measurements, error bands, rankings of parameters."""
