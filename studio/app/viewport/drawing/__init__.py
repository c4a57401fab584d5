"""Drawing of views, to pixels.

`shapes.py` `mesh_picture.py`, `view_picture.py` (one picture of a view, meshes among splats by
depth, on whatever thread), `view_memory.py` (what stays from picture to picture), `outlines.py`
(shapes as strokes where there is no OpenGL), `painter.py` `pacing.py` (a view's thread),
`scene_drawing.py` (what all views share), `floor_errors.py` (a layer that takes a while to make).
"""
