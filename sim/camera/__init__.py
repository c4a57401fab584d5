"""The simulated 360 degree camera: its stand, both lenses drawn from meshes, and its sensor.

`camera360.py` (both lenses, drawn from meshes), `lens_picture.py` `lens_raster.py` `tessellate.py`
(meshes to fisheye pixels), `shadows.py`, `sensor.py` (noise, blur, vignetting), `stand.py`.
"""
