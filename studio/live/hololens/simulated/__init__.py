"""A simulated HoloLens in a live session, held against the truth.

`headset.py` (the process, as the session has it), `stand_in.py` (that process), `pointing.py` (a
remote person in it who points at legs of chairs, and what of it is seen on the headset),
`attacking.py` (hostile visitors in it at the session's ports).
"""
