"""What plays in the window: a rehearsal or recording, or a live session."""
