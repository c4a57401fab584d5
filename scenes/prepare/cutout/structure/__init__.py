"""What the splats of a room show by themselves: connected bodies, level planes, similar colours."""
