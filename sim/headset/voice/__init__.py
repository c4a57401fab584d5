"""Voices of simulated people: how they speak and hear.

`tone.py` (a tone as Opus), `speech.py` (over the WebSocket or by WebRTC), `peer.py` (the latter).
"""
