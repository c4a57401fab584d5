"""Splat file formats, one file a format.

One file a splat or mesh format; `registry.py` picks one by a file's name.
"""
