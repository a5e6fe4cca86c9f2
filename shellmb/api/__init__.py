"""The Python interface: `import shellmb as sm` (`docs/reference/python.md`)."""
