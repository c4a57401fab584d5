"""Choosing pictures from videos and photos."""
