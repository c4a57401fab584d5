"""Picking, dragging and tools of the mouse in a view."""
