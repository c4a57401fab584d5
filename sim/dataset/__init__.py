"""Pictures of the simulated camera with exact truth per frame, for other people's trackers.

`write.py` (whole or not at all), `room_folder.py` (docs/datasets.md), `bop.py` (the BOP
form), `check.py` (a reader of each form).
"""
