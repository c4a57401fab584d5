"""A simulated HoloLens 2 on the network: the bytes of a real one, a wearer, a room, and faults.

`simulator.py` (all of it) on `world.py` (its clock, its world, its wearer), `wearer.py` (people who
wear it), `acting.py` (people of a scenario who do), `faults.py` (what goes wrong), `meshing.py`
(surfaces of the room), `holograms.py` (what it shows), `axes.py` (the room's values as its
numbers). Rooms: `ports/`, `drawing/` (video).
"""
