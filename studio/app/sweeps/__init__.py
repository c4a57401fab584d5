"""Sweeps: faults of every size, begun and looked at in the window."""
