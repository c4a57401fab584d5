"""Pose of a headset in the room: printed codes in its video, fused over time.

`codes.py` (codes in one picture), `corner_fit.py` (their corners to a pose with covariance),
`followed.py` (a pose through many pictures, and when it has changed), `origin.py` (the room's
origin in the headset's world, and the code on the 360° camera), `glide.py` (what is shown of it,
without a jump). "Device" is the headset's own world, as in the package devices.hololens.
"""
