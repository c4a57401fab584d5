"""The HoloLens in a live session: whose wearer is the local user, and what it shows them.

`worn.py` (all of it, begun and ended), `anchoring.py` (the shared origin, from its video),
`body.py` (head, hands and gaze as an avatar), `local_user.py` (the wearer among people),
`carrying.py` (shapes in their hands), `meshing.py` (its mesh into the room's physics and to remote
people's pages), `rig_code.py` (the code on the camera), `timing.py` (delays, gathered),
`address.py` `checks.py` (before going live). Figures: `figures.py`, `wearing.py`. `showing/` is
what the wearer sees; a simulated one is in `simulated/`.
"""
