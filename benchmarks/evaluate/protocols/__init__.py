"""Stations, boards and rooms that are arranged to answer one question of a table."""
