"""Bodies of people: from a head and hands to a figure that is nice to look at.

`skeleton.py` (bones, lengths, limits of joints) on `vectors.py`; `goals.py` (heads and hands as
given), `torso.py` `arms.py` `legs.py` `hands.py` (inverse kinematics of each), `solids.py` (boxes
that hands stay out of), `furniture.py` (a room's), `bones.py` (joints to bones), `solve.py` (all of
it, state in and out; `studio/web/shared/bodies/` has the same for browsers); `implicit.py` (blended
shapes to triangles), `wardrobe.py` (parts of a figure), `figure.py` (its skin, moved by bones),
`crowd.py` (everybody of a state, from picture to picture).
"""
