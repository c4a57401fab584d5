"""The study kit: tasks, conditions and questionnaires in one file, played live, measured, reported.

`plan.py` (a study's TOML), `order.py` (Latin squares, anonymous ids, trials), `questionnaires.py`
`scoring.py` (SUS, presence, NASA-TLX, the paper's own), `folder.py` (consent, answers and trials
that are kept), `printing.py` (forms on paper), `goals.py` (layouts and figures judged),
`asking.py` (what the live page asks, and its answers), `people.py` (conditions, and nobody's name),
`trial.py` (one task in a live session), `measures.py` `tables.py` (recordings to tidy tables),
`statistics.py` `plots.py` `paper.py` `report.py` (tests, plots, published figures, the page).
"""
