"""`nexus evaluate ...`: `tables.py` (the tracker's), one file each of the others."""
