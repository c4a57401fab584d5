"""Remaining room: background, residual splats, shadows, the hole that is filled."""
