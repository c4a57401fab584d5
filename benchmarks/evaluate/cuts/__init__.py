"""Cut-outs in rooms that nobody tuned on: random rooms filmed by the simulated phone, and others.

`printed_codes.py` (on the walls of a room that has none).
"""
