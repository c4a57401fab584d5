"""What a view shows, to pixels."""
