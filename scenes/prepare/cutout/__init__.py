"""Making movable objects of parts of a room."""
