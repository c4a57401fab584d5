"""From votes to labels: which splats are the object."""
