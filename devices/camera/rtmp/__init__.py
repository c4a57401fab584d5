"""Cameras that push RTMP: what they say, and who listens.

`listener.py` (the socket), `session.py` (what is said on it), `chunks.py` `amf.py` `flv_video.py`
(its bytes).
"""
