"""Documents: edited, kept, restored and dropped in."""
