"""The BOP form (bop.felk.cvut.cz), the pose-estimation field's own: written, and read back."""
