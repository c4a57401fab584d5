"""Depth that the photos give by themselves, before anything is trained."""
