"""`nexus cut` and what follows it: objects out of a room, more of their splats, less of others."""
