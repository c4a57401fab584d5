"""A film on real sockets: the camera that plays it, and one output a protocol.

`camera.py` (plays it), `output.py` with `rtmp_output.py` `rtsp_output.py` `insta360_output.py` (one
a protocol), `outbox.py` (what waits to be sent), `truth_file.py` (what a parent compares with),
`events.py`.
"""
