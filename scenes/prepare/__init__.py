"""From a capture (or from meshes) to a scene package.

`pipeline.py` (the stages in order), `options.py`, `room_splats.py`, `collision.py`.
"""
