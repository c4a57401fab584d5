"""What the mouse does to the room."""
