"""Trackers of a session: by name, guarded, with settings, and what it says of the camera."""
