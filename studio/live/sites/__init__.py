"""One building: live rooms that sites on other machines join, over a router.

`sharing.py` (a session shared, as it was asked for) with `shared_room.py` (its side: state and
people out, what sites send in), `site_people.py` (people of all sites) and `deciding.py` (what
they ask of shapes); `joined_site.py` (a site's side: a hub that is fed by a room elsewhere);
`turns.py` (both look at what is new, again and again); `reaching.py` (addresses, passes, the list
of rooms), `building.py` (the folder of a building's router).
"""
