"""Records of a session: its folder, its recording, the versions that made it."""
