"""Simulated headsets: people who join a live session over the network, as a browser would.

`moves.py` (head, hands, controllers and ray of one person), `doings.py` (what a hand draws, puts,
proposes and carries), `scripted.py` (somebody who plays a part in a scenario), `answering.py`
(somebody who answers what a study asks), `faults.py` (what goes wrong between headset and hub),
`connection.py` (pairing and the WebSocket), `room_download.py` (files of the room), `client.py`
(one person who joins, moves and draws), `hearing.py` (what comes to them), `device.py` (their
headset, as its page says it), `tally.py` (figures of all, and how long messages took), `crowd.py`
(many people in one process), `attacks.py` (people who try what they may not). `voice/` is how they
speak and hear.
"""
