"""Where the 360° camera stands, from one picture of a known room and nothing else."""
