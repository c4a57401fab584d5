"""Live surfaces: flat quads in the room that show what the camera sees there now (paper 4.3).

`live.py`, `view.py`, `corners.py`.
"""
