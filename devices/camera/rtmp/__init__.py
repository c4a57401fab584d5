"""Cameras that push RTMP: what they say, and who listens.

`listener.py` (the socket), `session.py` (what is said on it, and the pictures in it: Adobe, "Video
File Format Specification 10.1", annex E.4.3; Veovera, "Enhanced RTMP v1"), `chunks.py` `amf.py`
(its bytes). FFmpeg's own listener (PyAV, `listen=1`) gives up at the first garbage, is held by one
silent connection until its timeout (25 s of 25), takes any key and knows no port 0.
"""
