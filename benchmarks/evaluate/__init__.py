"""Tracker, preparation and twin against the truth: what `nexus evaluate` runs.

`findings.py` `drawings.py` (what a table gives), `answers.py` (a tracker's, judged);
`preparation_scores.py` on `cutouts.py` `true_labels.py` (preparations and cut-outs against the
meshes that were filmed).
"""
