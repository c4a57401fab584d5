"""Cameras that the studio pulls from: FFmpeg in a process of its own, which may hang or crash."""
