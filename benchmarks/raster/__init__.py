"""How exact and how fast the native splat renderer is.

`raster.py` (the verb) on `gradients.py` `stage_rows.py` `peers.py`, in `splat_scenes.py`;
`stages.py` (drawing, stage by stage), `open3d_peer.py`.
"""
