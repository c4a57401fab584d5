"""What goes wrong in a rehearsal: each fault one small piece, read from a scenario's `[faults]`."""
