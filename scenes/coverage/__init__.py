"""From which directions photos saw an object: directions as bits, the record of every splat.

`directions.py` (a sphere in 64 cells), `record.py` (of every splat, and of the box around it),
`sides.py` (that box in cells, and what photos saw of each side).
"""
