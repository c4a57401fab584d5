"""Pictures of a simulated HoloLens's camera: the room drawn from meshes, coded as it codes them.

`scenery.py` (what is seen and where it is), `drawer.py` with `process.py` (drawing in a process of
its own), `time_code.py` (a time in a picture), `encoder.py` (H.264, HEVC, raw).
"""
