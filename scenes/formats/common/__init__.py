"""What all formats share: errors, activations, axes, bounded memory, atomic writes."""
