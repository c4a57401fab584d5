"""Smaller versions of an object or a room, for where it is drawn small."""
