"""The native kernels, the options they run with, and arrays as they take them.

The native kernels and `options.py`, their constants for both languages.
"""
