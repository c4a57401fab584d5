"""How fast the studio answers: `nexus bench studio`, a process a figure."""
