"""Work on threads of its own: scenes, live cameras, packages to share."""
