"""The floor from above: people, their ways and goals as handles.

`view.py` of `handle.py` (what is dragged), `backdrop.py` (the room below it,
opened on a thread).
"""
