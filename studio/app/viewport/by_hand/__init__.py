"""Picking, dragging and tools of the mouse in a view.

`picking.py` `items.py` (what is under the mouse), `handles.py` on `gizmo.py` `corners.py` (what can
be held), `dragging.py` (what is held), `tools.py`.
"""
