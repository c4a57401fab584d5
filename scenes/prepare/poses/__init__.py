"""Camera poses of the pictures."""
