"""How well a rehearsal in a scan predicts what happens in the real room."""
