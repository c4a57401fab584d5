"""True range, outline, visible share, size and symmetry of each object in a lens."""
