"""What moves in a model: objects, virtual solids, people, what a tracker moves."""
