"""A folder of photos, 360° pictures and exact truth, taken through prepare, cut and track.

`layout.py` on `json_field.py` (the folder), `preparing.py` `tracking.py` `scoring.py`;
`rehearsed_pictures.py` `prediction.py` (rehearsed errors against measured ones).
"""
