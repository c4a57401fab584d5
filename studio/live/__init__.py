"""Live sessions: a real or simulated 360° camera in, objects followed, everything recorded.

`setup.py` (devices as TOML), `checks.py` (before going live), `live.py` `status.py` `changes.py` (a
session, its commands, how it is doing), `approach.py` `placing.py` `locating.py` (from an address
to layout, lenses and where the camera stands), `filmed.py` (the same of footage),
`relocation.py` (when it was carried away), `camera_frames.py` (packets to the recording, newest
picture to the tracker), `report.py`, `shortfalls.py` (why pictures were dropped and objects lost);
`rehearsed.py` `against_truth.py` (a session on a simulated camera, and its figures).
"""
