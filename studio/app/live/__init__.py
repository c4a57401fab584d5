"""The live session in the window: address, layout, checks, one button, how it goes.

`dock.py` of `head.py` (state, the one button, banner), `camera_view.py` (what the camera shows),
`camera_page.py` (which camera), `headset_page.py` `headset_words.py` (the local user's HoloLens),
`quest_page.py` (headsets that have joined by the page), `words.py` (states and banners in words).
"""
