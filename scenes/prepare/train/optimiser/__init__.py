"""One step after another: what is made small, by what, and how that changes on the way.

`rows.py` (what is kept of a splat), `exposure.py` (of each photo), `schedule.py` `densify.py` (what
changes on the way).
"""
