"""Speed, one file a subject."""
