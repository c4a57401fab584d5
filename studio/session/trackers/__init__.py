"""Who tracks in a session: by name, guarded, with settings, and what it says of the camera."""
