"""Work on threads of its own: scenes, live cameras.

`scene_job.py`, `live_job.py`; `sessions.py` (what docks may ask of what plays).
"""
