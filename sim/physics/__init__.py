"""The physics of a room, on MuJoCo: its models, and which of them a room gets.

`any_room.py` (the protocol, and which of the two a room gets: `world.py` of a built-in room's
boxes, or a scan's twin), `by_hand.py` (a room that a user reaches into) on `mouse_hand.py`
`clear_place.py`; `engine.py`.
"""
