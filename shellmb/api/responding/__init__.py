"""Linear systems about any state, and their response: harmonic, random, by base motion, shock."""
