"""How exact and how fast the native splat renderer is."""
