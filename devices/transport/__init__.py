"""The way between machines: newest values and logs of rooms and sites, in a process or over zenoh.

`transport.py` (the protocol: put, subscribe, serve, ask), implemented twice: `local.py` (within a
process) and `zenoh_transport.py` (over a router). On either: `source.py` (all that one member
publishes: newest values, logs with a snapshot, a beat) and `follower.py` (all that is heard of
others, made whole again after any loss) with `followed.py` (one of them), `wire.py` (their bytes),
`keys.py` (who may be named how). For the router: `access.py` (its configuration and rules by role),
`passes.py` (certificates by which members are known).
"""
