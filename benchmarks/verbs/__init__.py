"""One file a verb of `nexus bench` and `nexus evaluate`, and the table of them.

`table.py`: the verbs of `nexus bench` and `nexus evaluate`; one file a verb, `evaluate.py` holds
the table of tables.
"""
