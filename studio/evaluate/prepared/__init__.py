"""What a preparation is judged by."""
