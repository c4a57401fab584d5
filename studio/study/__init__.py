"""The study kit: tasks, conditions and questionnaires in one file, played live, measured, reported.

`plan.py` (a study's TOML), `order.py` (Latin squares, anonymous ids, trials), `questionnaires.py`
(their items), `folder.py` (consent, answers and trials that are kept), `printing.py` (forms on
paper), `goals.py` (layouts and figures judged), `asking.py` (what the live page asks, and its
answers), `people.py` (conditions, and nobody's name), `trial.py` (one task in a live session).
`results/` makes tables and a report of it.
"""
