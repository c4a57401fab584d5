"""The live session in the window: address, layout, checks, one button, how it goes."""
