"""What a session or a preparation leaves behind: pages and films."""
