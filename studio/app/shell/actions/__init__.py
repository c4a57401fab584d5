"""Actions of the main window's menus and keys, a file a subject.

Files, `export.py` (splats to a file), sessions, live, people, tracker, window.
"""
