"""Keys, and lists of what can be done: palette, cheat sheet, editor."""
