"""People in the window: who may join the live session, a code for them, who is here.

`guests.py` (doors, codes and people without Qt) on `needed.py` (what of a session it uses),
`words.py` (states in words), `actions.py` (all of it for keys, palette and scripts), `qr_code.py`
(an address as squares), `invitation_view.py` (code, squares and time left), `person_row.py` (one
person), `dock.py` (the panel).
"""
