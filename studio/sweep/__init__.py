"""The same rehearsal again and again, with faults of several sizes: how much is too much?

`plan.py` (the runs), `play.py` (one), `child.py` `local.py` `cluster.py` (where they run),
`results.py` (resumed), `page.py`.
"""
