"""Many rooms and their sites on one machine, measured; a thousand of them, reckoned.

`orders.py` (how large a building, and what its processes say of themselves), `rooms.py` `sites.py`
`clients.py` (the processes beside a router), `building.py` (all of them run together), `load.py`
(messages and bytes that rooms and clients cause), `thousand.py` (a building of any size: waiting at
a router, which machine is full first, and how far off the reckoning was where it was measured).
"""
