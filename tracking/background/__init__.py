"""The empty room in the lenses: drawn, exposed, learned, compared with the live pictures.

`images.py` (drawn, exposed, compared), `learning.py`.
"""
