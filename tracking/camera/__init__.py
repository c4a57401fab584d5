"""The 360° camera's own pose: refined against the room's splats, and watched.

`calibration.py` (the rounds), `window_search.py` `window_slopes.py` (where windows of the drawn
room are seen), `rigid_fit.py` (the pose from those); was it bumped: `watch.py` `common_motion.py`
(the motion that all of the room shares), `rig_state.py` (a cheap look at every frame; standing,
moved, blind); `rig_tracker.py` (all of this from frame to frame, and the background that
is learned from there).
"""
