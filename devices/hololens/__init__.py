"""A HoloLens 2: what it sees, where its wearer's head and hands are, and what is drawn on it.

`headset.py` (all that the program asks) takes a `plan.py`, gives `values.py`, and draws a
`display_list.py`. A port a file: `configuration.py` (settings, and its clock), `body.py` (head,
eyes, hands), `surfaces.py` (the room's mesh), `display.py` with `display_orders.py`; `axes.py` (its
numbers as the studio's). Rooms: `camera/` (its video), `wire/` (bytes), `links/` (connections and
consumers).
"""
