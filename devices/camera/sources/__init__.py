"""Sources of units: files, Insta360 over Wi-Fi, and cameras that the studio pulls from.

The last are read by FFmpeg in a process of its own, which may hang or crash.

`file_source.py`, `insta360_source.py` (over Wi-Fi), and cameras that the studio connects to, RTSP,
UDP, HLS, V4L2: `pull_source.py` (starts, watches and kills a process), `pull_process.py` (that
process: FFmpeg), `unit_line.py` (what they say to each other).
"""
