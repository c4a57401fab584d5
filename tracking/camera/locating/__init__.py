"""Pose of the 360° camera from one picture of a known room and nothing else."""
