"""Computing a long search in a process beside the frames."""
