"""Free floor of a room, and ways on it for people."""
