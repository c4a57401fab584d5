"""Models made before the first frame: objects, their light and symmetry, support planes."""
