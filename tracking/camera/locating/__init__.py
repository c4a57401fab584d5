"""Pose of the 360° camera from one picture of a known room and nothing else.

`locate.py` (the whole way, and what is refused), `room_map.py` on `panorama.py` (the room from
everywhere, compared at all turns), `hypotheses.py` (refined and weighed).
"""
