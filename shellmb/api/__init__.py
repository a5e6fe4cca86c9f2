"""The Python interface: `import shellmb as sm` (`docs/api.md`)."""
