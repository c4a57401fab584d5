"""The simulated phone that films a room: its path, its light, its pictures, its capture.

`path.py` (how it is carried), `light.py` `raster.py` (its pictures), `capture.py` (what it saves),
`phone.py`.
"""
