"""Keys, and lists of what can be done: palette, cheat sheet, editor.

`command_palette.py` `cheat_sheet.py` `key_editor.py` (all that can be done, and by which keys),
`single_keys.py` (keys without Ctrl, and where they work).
"""
