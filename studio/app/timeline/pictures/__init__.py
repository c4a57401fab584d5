"""Pictures of the camera and of live surfaces at any instant of a recording."""
