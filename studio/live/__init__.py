"""Live sessions: a real or simulated 360° camera in, objects followed, everything recorded."""
