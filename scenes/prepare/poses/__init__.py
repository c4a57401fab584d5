"""Where the pictures were taken."""
