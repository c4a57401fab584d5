"""Actions of people: one file a kind of action, and what several of them need.

`walking.py` `carrying.py` `handing_over.py` `pointing.py` `pushing.py` `sitting.py`; what several
need: `reaching.py`, `supports.py` (what something can stand on).
"""
