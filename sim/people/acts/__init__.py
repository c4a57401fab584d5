"""What a person can do: one file a kind of action, and what several of them need."""
