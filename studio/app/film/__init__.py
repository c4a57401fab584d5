"""Films of what one view shows, as MP4."""
