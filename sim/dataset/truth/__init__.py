"""True range, outline, visible share, size and symmetry of each object in a lens.

`lens_truth.py` `pinhole_views.py` (range, ids, silhouettes), `visibility.py`, `surfaces.py`
`symmetry.py` (of objects), `agreement.py` (whether all of it fits).
"""
