"""Parts of a recording: how its values are written, and what is known of a file before it is read.

`people.py` (what people show and make, as JSON), `schemas.py` (fields of every message, for viewers
of MCAP files), `index.py` (a file opened, and whether it is whole).
"""
