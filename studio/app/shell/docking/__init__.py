"""Docks of the main window: the list, their layouts, their heights.

`docks.py` (the list), `window_docks.py` (made, filled, arranged; the timeline low while it is
empty), `layouts.py` (in shares of the window).
"""
