"""Sources of units: files, Insta360 over Wi-Fi, and cameras that the studio pulls from.

The last are read by FFmpeg in a process of its own, which may hang or crash.
"""
