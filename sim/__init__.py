"""The digital twin: MuJoCo world, simulated cameras and people, ground truth.

`rehearsal.py` (script to frames), `truth.py` (what a frame really showed), `bodies.py` (what the
simulated camera sees of anything that moves), `tables.py` (TOML checked, key by key).
"""
