"""One object from frame to frame: rest, motion, occlusion, loss and re-detection.

`follow.py`, `first_frame.py` (all objects, settled together), `track.py` (its memory), `belief.py`
(what a frame's odds decide), `outcome.py` (measured, missed, lost, held), `rest.py` (patches of
what rests), `posterior.py` (pose priors), `redetection.py`.
"""
