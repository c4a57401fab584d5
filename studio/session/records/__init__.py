"""Records of a session: its folder, its recording, the versions that made it.

`outputs.py` (a folder of results, complete or absent), `live_recording.py` (a recording that may
fail alone), `provenance.py` (versions of what made it), `cut_short.py` (stopped before its end),
`recorded_scene.py` (the scene that a recording took place in).
"""
