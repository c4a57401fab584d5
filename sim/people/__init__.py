"""People: what they are in a model, what they do, and who decides it."""
