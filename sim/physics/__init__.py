"""The physics of a room, on MuJoCo: its models, and which of them a room gets."""
