"""Trackers of a session: by name, guarded, with settings, and what it says of the camera.

`methods.py` (who tracks, by name), `guarded.py` (somebody else's tracker, whatever it does),
`settings.py` (tried beside, followed, replayed), `camera_events.py` (what is said of the camera).
"""
