"""Rectangles of a lens picture; outline and points of an object drawn into one."""
