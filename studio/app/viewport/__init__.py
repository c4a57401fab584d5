"""The view of the twin: splats and meshes in one picture, walked through, picked in, measured.

`viewer.py` `orbit.py` `walk.py` (where from), `layers.py` `labels.py` (what is shown), `view.py` on
`seen_twin.py`, `view_grid.py` `view_overlay.py` `view_actions.py` (what Qt shows).
"""
