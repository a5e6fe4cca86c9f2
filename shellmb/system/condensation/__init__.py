"""Static condensation of what cells eliminate, and the reduced systems that are left."""
