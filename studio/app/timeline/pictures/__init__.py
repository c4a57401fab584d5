"""What the camera and live surfaces showed at any instant of a recording."""
