"""Drawing splats: one protocol, a float64 reference and the native kernel behind it.

`renderer.py` (the protocol), `native.py` (Rust), `still.py` (only what moved is drawn again),
`gradients.py` (derivatives), `training.py`, `reduction.py` (fewer splats
for much the same picture).
"""
