"""How splats get to a disk and back: bounded memory, atomic writes, activations, refusals."""
