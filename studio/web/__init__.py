"""A room in a browser: the live room's page, and what the shared viewer has in common with it.

`live_page.py` (the page that people join by, as files for the hub) with `room_files.py` (the room
in two steps, each object, where all of it stands); `live/` holds the page itself: `start.js`
(joining), `link.js` (the connection), `main.js` (the room), and a module for each thing that is
seen or done. `splat_parts.py` `browser_spz.py` (splats within a size, as browsers read them),
`views.py` (where one looks from), `web_files.py` (three.js, Spark and the modules in `shared/`),
`figure_file.py` (people's figure and the numbers of their solver, which `shared/bodies/` has again
in the browser's language).
"""
