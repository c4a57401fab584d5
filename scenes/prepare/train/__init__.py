"""Splats from photos with poses."""
