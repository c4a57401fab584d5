"""A scenario's text while it is edited: every byte stays that nobody means to change.

`toml_spans.py` `toml_edits.py` `edits.py` (edits that keep every other byte), `editing.py` (what is
typed, what was last good), `editor.py` (what is seen of it).
"""
