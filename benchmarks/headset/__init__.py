"""The local user's headset against the truth.

`walks.py` (what it films on walks through physical rooms, with its own errors), `origin.py` (the
shared origin along such walks).
"""
