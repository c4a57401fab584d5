"""What a session leaves behind: its folder, its recording, what made it."""
