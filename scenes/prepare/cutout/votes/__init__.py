"""From masks to votes of splats: how much of their light falls inside, in which views."""
