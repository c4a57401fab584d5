"""Choosing pictures from videos and photos.

Sharpness, steps, what is left out; `picture_files.py` (any picture file), `hdr.py`
`equirectangular.py` (films that are not flat pictures in standard range).
"""
