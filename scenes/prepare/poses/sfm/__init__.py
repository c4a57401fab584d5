"""Structure from motion in a process of its own."""
