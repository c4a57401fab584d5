"""A simulated HoloLens 2 on the network: the bytes of a real one, a wearer, a room, and faults.

`simulator.py` (all of it) on `world.py` (its clock, its world, its wearer), `wearer.py` (people who
wear it), `faults.py` (what goes wrong). What it sees: `scenery.py` (the room, drawn), `encoder.py`
(video), `time_code.py` (a time in a picture), `meshing.py` (surfaces). What it shows:
`holograms.py`. `axes.py` (the room's values as its numbers). Room: `ports/`.
"""
