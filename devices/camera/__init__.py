"""Live 360° cameras: addresses, the streams they send, and the pictures received from them.

`address.py` (what a person types), `receiver.py` (the thread that reads: newest picture, state in
words, gaps), `decoding.py` (the one that decodes: what a newer keyframe makes useless is left out),
`received.py` (what it hands out), `units.py` (what every source yields), `container_units.py` on
`ts_datagrams.py` (what FFmpeg opens), `annex_b.py`, `stream_decoder.py` on `unit_sets.py` (to
pictures, of one or more tracks).
"""
