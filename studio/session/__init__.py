"""A running session: what enters, who tracks, what is recorded, in which order.

`plan.py` (what is played), `opening.py` (`open_session`, the composition root), `session.py` (what
runs), `pipeline.py` (what enters, and how it gets to the stages), `staging.py` (where it takes
place), `preflight.py` (what is looked at before), `fork.py` (what goes on, and its proof),
`live_surfaces.py`, `latency.py` (how it is doing).
"""
