"""Sessions that play in the window: a rehearsal, a recording, or a live session.

`session_run.py` on `trackers.py` `ending.py` `handing_over.py`, `live_run.py`, `guests.py` (who
joins it); `session_folders.py` (what each leaves); `leaving.py` (another document instead of the
open one).
"""
