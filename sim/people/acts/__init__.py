"""Actions of people: one file a kind of action, and what several of them need."""
