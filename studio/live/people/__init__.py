"""People in a live session: what they send enters it, and its state goes to them.

`entering.py` (avatars, lines and surfaces into the session's messages), `hosting.py` (a hub beside
the session, codes to join, who is here), `doors.py` (that hub opened and closed as the session
runs), `page.py` (the page that it serves), `pictures.py` (what live surfaces show, sent to
everybody), `headsets.py` (how their headsets are doing), `desk.py` (people looked after by lines
typed in a terminal), `crowd.py` (simulated people in a process of their own, and their figures).
"""
