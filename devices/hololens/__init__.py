"""A HoloLens 2: what it sees, where its wearer's head and hands are, and what is drawn on it.

`headset.py` (all that the program asks) gives `values.py` and takes `display_list.py`.
"""
