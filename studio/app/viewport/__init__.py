"""The view of the twin: splats and meshes in one picture, walked through, picked in, measured."""
