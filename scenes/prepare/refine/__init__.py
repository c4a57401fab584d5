"""Objects and regions sharpened with the photos' own resolution, after the room was trained.

`scene.py` (of a package, and back), `refine.py` (the loop), `crops.py` (the photos' parts),
`surface.py` (splats put on one surface).
"""
