"""Splats straight from meshes, with a scan's faults."""
