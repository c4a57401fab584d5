"""Protocol of the hub: texts, bodies and surfaces of people, each checked as it is read.

`messages.py` (texts) on `fields.py` (their fields), `wire.py` (head, hands and controllers in
bytes), `mesh.py` (surfaces that hide, by cell).
"""
