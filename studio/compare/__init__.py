"""One rehearsal held against another: figures, floor plans, films.

`run.py` (what a folder holds), `verdicts.py` (what got worse), `floor_cells.py` (errors by place),
`error_map.py` (a drawing), `page.py`.
"""
