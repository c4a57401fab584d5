"""People in the window: who may join the live session, a code for them, who is here.

`dock.py` (the panel) of `invitation_view.py` (code, squares and time left), `person_row.py` (one
person), `words.py` (states in words).
"""
