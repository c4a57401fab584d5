"""Drawing of views, to pixels.

`shapes.py` `mesh_picture.py`, `view_picture.py` (one picture of a view, meshes among splats by
depth, on whatever thread), `opengl_trial.py` (whether there is OpenGL), `outlines.py` (shapes as
strokes where there is none), `painter.py` `pacing.py` (a view's thread), `scene_drawing.py`
`mesh_thread.py` (what all views share), `floor_errors.py` `collision_wire.py` `unseen_sides.py`
(layers that take a while to make).
"""
