"""What a room is: geometry, cameras, splats, formats, rendering, preparation, the scene package."""
