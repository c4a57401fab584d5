"""Results of a study: measures, scores, tests, tables and plots, and the report of them.

`measures.py` `tables.py` (recordings to tidy tables), `scoring.py` (SUS, presence, NASA-TLX, the
paper's own), `statistics.py` `plots.py` `paper.py` `report.py` (tests, plots, published figures,
the page).
"""
