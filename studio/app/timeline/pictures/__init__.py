"""Pictures of the camera and of live surfaces at any instant of a recording.

`thread.py` (what was asked for last), `reader.py` on `decoding.py` (the exact picture),
`live_pictures.py` (live surfaces); `proxies.py` `proxy_process.py` `proxy_file.py` (reduced
pictures, made beside it and kept in the user's cache).
"""
