"""The twin by hand: what is in the room, moved, thrown, added and annotated."""
