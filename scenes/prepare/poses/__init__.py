"""Camera poses of the pictures.

Imported poses (`photo_files.py` finds the photos, `transforms_lens.py` reads the lens), or
structure from motion in a process of its own.
"""
