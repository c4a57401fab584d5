"""Faults of a rehearsal, by where they act, read from a scenario's `[faults]`.

`fault.py` (what each has, where it can act and when), `settings.py` (which there are); of the
light, on the way, of the devices, and what stands in the room: an occluder, unscanned twins.
"""
