"""Cut-outs in rooms that nobody tuned on: random rooms filmed by the simulated phone, and datasets.

`capturing.py` on `printed_codes.py` (filmed and prepared), `captures.py` `truth.py` `marking.py`
(what is there, and how a person marks it), `cutting.py` `scores.py` `cases.py` (one object),
`judging.py` `rows.py` (all of them), `refining.py` on `true_views.py` (refined models).
"""
