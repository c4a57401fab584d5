"""A rehearsal handed over: film, viewer, session sheet and archive."""
