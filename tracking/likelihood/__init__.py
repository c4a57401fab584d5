"""How well a window supports a pose."""
