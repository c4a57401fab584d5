"""Drawing splats: one protocol, a float64 reference and the native kernel behind it."""
