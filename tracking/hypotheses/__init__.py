"""Where an object may be: candidate positions, searches, and which object takes which."""
