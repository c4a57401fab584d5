"""Choosing pictures from videos and photos.

Sharpness, steps, what is left out; `video_tracks.py` (a track, or a file, a lens),
`picture_files.py` (any picture file), `hdr.py` `equirectangular.py` (films that are not flat
pictures in standard range).
"""
