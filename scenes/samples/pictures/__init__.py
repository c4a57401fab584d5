"""Drawn pictures of the built-in rooms: textures, prints, wall art, and their atlas."""
