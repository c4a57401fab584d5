"""Threads and processes beside the caller: one protocol of progress, cancelling and errors.

`task.py` (one piece of work on a thread), `latest.py` (only the newest request counts),
`child_process.py` (a process and its end), `parent.py` (a process whose parent is gone), `pipes.py`
(how much goes into a pipe at once).
"""
