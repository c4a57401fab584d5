"""The built-in rooms, as physical meshes made by code."""
