"""A live room between machines: what it and its sites say to each other, in bytes that are checked.

`channels.py` (names and limits), `about.py` (what is said of a live room), `objects.py` `drawn.py`
`people.py` `pictures.py` `hidden.py` `wishes.py` (each kind of bytes, written and read; shapes are
wishes that the room decides); `mirror.py` (the room's state elsewhere, made of them by the
session's own reducer), `own_items.py` (what a site's people draw, on its way to the room and back).
"""
