"""The metric world that a reconstruction lies in."""
