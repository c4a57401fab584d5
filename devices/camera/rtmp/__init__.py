"""Cameras that push RTMP: what they say, and who listens."""
