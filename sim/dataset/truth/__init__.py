"""What a lens truly sees of each object: range, outline, visible share, size and symmetry."""
