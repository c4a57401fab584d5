"""Splats from photos with poses.

`trainer.py` (the protocol), `train.py` (the loop), `training_photos.py`, `seed.py` `coverage.py`
(where splats begin), `held_out.py` (how good they are), `checkpoint.py` `trained_file.py` (kept),
`external_trainers.py` `trained_import.py` (other programs).
"""
