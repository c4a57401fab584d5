"""A running session: what enters, who tracks, what is recorded, in which order."""
