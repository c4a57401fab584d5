"""From labelled splats to an object: its box, its solid parts, where it stands."""
