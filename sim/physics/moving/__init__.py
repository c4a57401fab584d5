"""Moving bodies of a model: objects, virtual solids, people, and those a tracker moves."""
