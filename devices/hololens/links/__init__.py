"""Connections to a headset's ports, and who gets what comes.

`connection.py` (bytes of one connection), `link.py` (a thread that keeps a port connected),
`health.py` (how that goes), `fan_out.py` (every consumer's newest value).
"""
