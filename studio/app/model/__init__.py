"""The studio without its window: what is edited, what can be done, what is remembered. No Qt."""
