"""`nexus bench ...`: one file a bench, and what those of the tracker's parts share."""
