"""Static collision geometry: a room's boxes, or patches fitted to a scanned surface.

`grid.py` `patches.py` `depths.py` `limits.py` `surface.py` (a scanned mesh as boxes and planes, and
its edits); `static_geoms.py` `overlap.py` (those in a running model); `orientation.py` (triangles
turned to their free side), `heights.py` (what is below a point).
"""
