"""From a capture (or from meshes) to a scene package."""
