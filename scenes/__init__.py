"""Rooms: geometry, cameras, splats, formats, rendering, preparation, the scene package.

`pose.py` `cameras.py` `splats.py` `mesh.py` `coloured_mesh.py` `state.py`; `frames.py` (every axis
flip); `opening.py` (any scene by name or path); `memory.py` (what is free goes back to the system,
and the heap stays small).
"""
