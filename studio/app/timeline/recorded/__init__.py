"""Content of a recording, read once, at any instant."""
