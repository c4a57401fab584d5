"""The byte layouts that splats or meshes are packed in."""
