"""Docks of the main window: the list, their layouts, their heights.

`docks.py` (the list), `window_docks.py` (made, filled, arranged), `layouts.py` (in shares of the
window), `timeline_height.py` (low while it is empty).
"""
