"""Structure of a room's splats: connected bodies, level planes, similar colours."""
