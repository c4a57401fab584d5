"""Depth that the photos give by themselves, before anything is trained.

`stereo.py` (by other photos), `propagated.py` (from neighbouring views), `seen_surfaces.py` (on a
surface or in front of all).
"""
