"""The paper's three examples: their runs, figures and statements (`shellmb figures`)."""
