"""Faults of a rehearsal, a file each, read from a scenario's `[faults]`.

`fault.py` (what each has, and where it can act), `settings.py` (which there are), `span.py` (when);
to the light, on the way, in the room.
"""
