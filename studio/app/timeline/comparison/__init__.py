"""Two runs: forks, their tables, and the runs beside each other."""
