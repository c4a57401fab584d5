"""The studio without its window: what is edited, what can be done, what is remembered. No Qt.

`workbench.py` on `topics.py` (what all docks share), `standing.py` (editing, playing, recorded,
live: all ways between them), `actions.py` (all that can be done), `settings.py`, `script.py`
`names.py` (what everything is called), `own_address.py` (where a live camera pushes to).
"""
