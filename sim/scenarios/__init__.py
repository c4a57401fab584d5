"""Scenarios: how their files are read, what people are asked in them, and those that come along.

Scripts that come with the program (one TOML file each); `scenario.py` (reads them),
`arrangement.py` (what was arranged before), `first.py` (one for any room), `switch.py` (going on
with another), `actions.py` `action_tables.py` `action_checks.py` (what people can be asked).
"""
