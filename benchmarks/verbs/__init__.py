"""The verbs that measure, one file each, and the table of them.

`table.py`: those of `nexus bench` and `nexus evaluate`; a file each in `bench/` and `evaluate/`.
"""
