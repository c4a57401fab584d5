"""Remaining room: background, residual splats, shadows, the hole that is filled.

The filled hole, shadows, residual splats, floaters, what a hand marks as dirt (`cleaning.py`).
"""
