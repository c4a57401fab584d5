"""The renderer and its derivatives in numpy: readable, slow, the oracle of the native ones."""
