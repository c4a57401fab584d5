"""Which splats are the object: by surfaces that many photos agree about, or by votes of few views."""
