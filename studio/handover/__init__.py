"""A rehearsal handed over: film, viewer, session sheet and archive.

`share.py` (the whole way), `moments.py` `keys.py` (a recording as what moves), `viewer_page.py`
(the page, of `viewer/` and what `studio/web` has for all pages), `sheet.py`,
`archive.py`.
"""
