"""From what a person marks in a view to the mask of one object.

Boxes and clicks in photos to masks; `drawn.py` (outlines and strokes of a hand).
"""
