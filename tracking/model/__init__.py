"""Models made before the first frame: objects, their light and symmetry, support planes.

`object_model.py` (colours, extent, fewer splats for small pictures), `symmetry.py`, `templates.py`,
`relighting.py`, `misfit.py`, `support_planes.py`.
"""
