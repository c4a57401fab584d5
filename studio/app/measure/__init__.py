"""How fast the studio answers: what `nexus bench studio` runs in processes of their own."""
