"""The digital twin: MuJoCo world, simulated cameras and people, ground truth."""
