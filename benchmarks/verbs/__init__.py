"""The verbs that measure, one file each, and the table of them.

`table.py`: the verbs of `nexus bench` and `nexus evaluate`; a file each in `bench/` and `evaluate/`.
"""
