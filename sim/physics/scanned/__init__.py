"""The physics of a scanned room: its surface, its objects and its twin."""
