"""Effects: what a scene simulates and what it leaves out, why, and what each effect costs."""
