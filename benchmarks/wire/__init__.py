"""Hostile bytes and failing networks, against parsers, clients and servers.

`fuzz.py` `fuzz_streams.py` `fuzz_people.py` `fuzz_sites.py` `fuzz_hololens.py` (for parsers),
`attack_hub.py` (for clients and servers, and the hub with people in it), `attack_hololens.py` (for
a HoloLens, simulated, and for who receives it); `relay.py` (the network between camera and studio,
which fails); `crowd.py` (people who move, in a process of their own), `hub_load.py` (the hub with a
crowd in it), `hololens_load.py` (delays of a HoloLens).
"""
