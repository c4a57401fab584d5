"""The scenario editor: people on the floor, actions on time, faults as knobs, and the text.

`dock.py`, `scenario_actions.py` (what its hands, keys and scripts do), `plan.py` (estimated times
and ways), `action_blocks.py` `action_form.py` (actions on time), `fields.py` `form.py` (what forms
ask for), `colours.py`; `sweeps_dock.py` on `asked_sweep.py` (sweeps: faults with sizes, table, open
a run).
"""
