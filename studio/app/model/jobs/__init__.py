"""Work on threads of its own: scenes, live cameras, packages to share.

`scene_job.py`, `live_job.py`, `share_job.py`; `sessions.py` (what docks may ask of what plays).
"""
