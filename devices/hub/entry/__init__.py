"""The way in: who is let in, how often somebody may try, how it is known that it is this machine.

`admission.py` (who comes in by what), `pairing.py` (codes of one use), `tokens.py` (signed,
short-lived), `rates.py` (how often), `certificates.py` (of this machine, for headsets and
browsers).
"""
