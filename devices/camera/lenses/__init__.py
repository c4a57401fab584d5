"""Pictures of a stream to pictures of lenses.

`layout.py` (how a picture holds the lenses), `search.py` on `upright_evidence.py` (how that is
estimated from the picture), `lens_pictures.py` (upright lens pictures).
"""
