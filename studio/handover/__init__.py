"""A rehearsal handed over: film, viewer, session sheet and archive.

`share.py` (the whole way), `moments.py` `keys.py` (a recording as what moves), `splat_parts.py`
`browser_spz.py` (splats within a size, as browsers read them), `viewer_page.py` (the page),
`web_files.py` (three.js and Spark), `sheet.py` `stills.py`, `archive.py`.
"""
