"""The three examples, each with its runs, figures and statements."""
