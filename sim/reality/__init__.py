"""Stand-in for the real room where only a scan of it exists."""
