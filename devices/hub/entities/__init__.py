"""Entities that people put into the room: lines, live surfaces, primitives, proposals.

`drawn.py` (one entity, on the wire and in the session's axes), `reading.py` (what a person asks
for, each field checked), `board.py` (all entities that are there, their limits, undo for each
person, and who has and moves what), `deciding.py` (what somebody may change now, what becomes of
it, and what the session takes of it).
"""
