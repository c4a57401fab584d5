"""The 360° camera's own pose: refined against the room's splats, and watched."""
