"""Integrands as programs, read off their UFL and run by one function in C."""
