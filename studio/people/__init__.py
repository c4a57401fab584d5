"""People come into the live room by a page in their browser.

`page.py` (the page as files that the hub serves) with `room_files.py` (the room in two steps, each
object, where all of it stands); `page/` holds the page itself: `start.js` (joining), `link.js` (the
connection), `main.js` (the room), and a module for each thing that is seen or done in it.
"""
