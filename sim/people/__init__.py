"""People: how they look, what they do, and who decides it.

How people look (`posture.py`, `figure.py`), a person who acts (`person.py`), who does it
(`actors.py`); `remote.py` (people elsewhere), `drawn_line.py` (what they draw).
"""
