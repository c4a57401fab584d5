"""Hostile bytes and failing networks, against parsers, clients and servers.

`hostile.py` (damaged copies), `fuzz.py` `fuzz_streams.py` (for parsers), `attack.py` (for clients
and servers); `relay.py` (the network between camera and studio, which fails).
"""
