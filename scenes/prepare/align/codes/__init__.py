"""Printed codes: their corners in photos, and the metric squares that these are of."""
