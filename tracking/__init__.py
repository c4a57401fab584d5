"""Frames in, object poses out. Never imports sim."""
