"""A splat scene of elsewhere made fit to live in: up, floor, unit, free space, collision mesh."""
