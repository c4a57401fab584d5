"""The simulated 360 degree camera: its stand, both lenses drawn from meshes, and its sensor."""
