"""The floor from above: people, their ways and goals as handles."""
