"""Integrands of forms as programs: read off their UFL, and run by one function in C that knows none of them."""
