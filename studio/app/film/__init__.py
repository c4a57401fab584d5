"""Films of what one view shows, as MP4.

`plan.py` `moments.py` (of what), `film_picture.py` `film_job.py` (drawn and written on a thread),
`view_films.py` (actions and bar).
"""
