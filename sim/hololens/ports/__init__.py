"""Ports of a simulated HoloLens, a file each, on what they share.

`serving.py` (one client at a time, bytes with faults), `configuration.py`, `video.py` with
`camera.py` (what its camera is like), `body.py`, `mapping.py`, `display.py`.
"""
