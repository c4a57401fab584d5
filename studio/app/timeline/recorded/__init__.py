"""What a recording holds, read once, at any instant."""
