"""Rooms: geometry, cameras, splats, formats, rendering, preparation, the scene package."""
