"""Pictures of the simulated camera with exact truth per frame, for other people's trackers."""
