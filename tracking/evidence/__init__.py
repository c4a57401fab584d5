"""What one frame shows of one object, and how the object would be drawn there."""
