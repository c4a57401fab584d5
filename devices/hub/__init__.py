"""The hub: people elsewhere join the live room over HTTPS and a WebSocket, each with a role.

`server.py` (all that the program asks) with `contract.py` (settings and values); `port.py`
(connections), `site.py` (HTTP), `connection.py` (one client's WebSocket). Below them no socket:
`session.py` (what is shared), `attendance.py` (people and their headsets), `roles.py` (rights),
`elsewhere.py` (people of other hubs), `outbox.py` (what waits for a client) on `channels.py`
(states, log, bodies, and the texts of rights and people), `inbox.py` (what the program takes).
Rooms: `protocol/` (texts, bodies and surfaces as they travel), `entry/` (codes, tokens,
certificates), `entities/` (what people draw and put, and undo), `media/` (voice, video).
"""
