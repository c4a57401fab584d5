"""What is edited, and how it is kept, restored and dropped in."""
