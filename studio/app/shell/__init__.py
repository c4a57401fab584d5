"""The main window: docks, menus, keys, palette, theme."""
