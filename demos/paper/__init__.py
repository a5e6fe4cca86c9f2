"""The paper's three examples: their runs, figures and statements (`python -m demos.paper`)."""
