"""How well a window supports a pose.

`pose_likelihood.py` (the one likelihood, in nats, by which everything is decided), `pixel_model.py`
(its constants), `drawn_object.py` (what it draws); for the solver `edges.py`, `contour_support.py`,
`patch_fit.py`.
"""
