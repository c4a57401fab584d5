"""The simulated phone that films a room: its path, its light, its pictures, its capture."""
