"""Insta360 cameras: control over HTTP, live preview over TCP, their files and lens calibration.

`preview.py` (live, TCP 6666) on `packets.py` `commands.py` `access_units.py` `camera_time.py`,
which touch no socket; `osc.py` (control over HTTP) on `osc_replies.py`; `condition.py` (battery,
card and clock), `protobuf.py`. `files/` is what they write, with the calibration of their lenses.
"""
