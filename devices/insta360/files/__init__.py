"""Insta360 files: the trailer with its records, and the lens calibration that they hold.

`trailer.py` (read and written), `metadata.py` (camera, lenses, clock), `samples.py` (gyro and
exposure), `offsets.py` (lens calibration as text) and `lens_rig.py` (as our camera model).
"""
