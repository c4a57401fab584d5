"""Cameras that push RTMP: what they say, and who listens.

`listener.py` (the socket), `session.py` (what is said on it, and the pictures in it: Adobe, "Video
File Format Specification 10.1", annex E.4.3; Veovera, "Enhanced RTMP v1"), `chunks.py` `amf.py`
(its bytes).
"""
