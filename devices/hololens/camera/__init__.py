"""The camera in a headset's forehead: switched on, streamed from, decoded, handed to consumers.

`video.py` (all of it, and the camera on and off) on `stream.py` (packets to pictures), and
`received.py` with `process.py` (receiving in a process of its own).
"""
