"""Docks of the main window: the list, their layouts, their heights."""
