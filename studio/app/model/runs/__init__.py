"""Sessions that play in the window: a rehearsal, a recording, or a live session."""
