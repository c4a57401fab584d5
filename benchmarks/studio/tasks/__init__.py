"""Three days of use: what a designer, an operator, a tester and a stranger do, step by step.

`steps.py` of `designer.py` `operator.py` `tester.py` `scaling.py`; `first_time.py` by `clicking.py`
(what a stranger wants, by real clicks), `crate.py` (what is cut out).
"""
