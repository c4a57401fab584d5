"""Faults of a rehearsal, a file each, read from a scenario's `[faults]`."""
