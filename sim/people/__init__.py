"""People: how they look, what they do, and who decides it."""
