"""A scenario's text while it is edited: every byte stays that nobody means to change."""
