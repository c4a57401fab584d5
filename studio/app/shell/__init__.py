"""The main window: docks, menus, keys, palette, theme.

Docks, menus, keys, command palette, themes, first page, scripts; `help_pages.py` (manual, About);
`work_in_progress.py` `questions.py` (nothing is lost); `share_dialog.py`; `wrapping.py` (rows that
go on in the next line).
"""
