"""Insta360 cameras: control over HTTP, live preview over TCP, their files and lens calibration.

`preview.py` (live, TCP 6666) on `packets.py` `commands.py` `access_units.py` `camera_time.py`,
which touch no socket; `osc.py` (control over HTTP) on `osc_replies.py`; `trailer.py` `metadata.py`
`samples.py` (their files), `offsets.py` (lens calibration) and `lens_rig.py` (as our camera model),
`protobuf.py`.
"""
