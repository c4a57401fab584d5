"""What every verb prints: rows of figures, progress, the machine."""
