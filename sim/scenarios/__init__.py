"""Scenarios: how their files are read, what people are asked in them, and those that come along."""
