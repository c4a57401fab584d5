"""The pose that fits a window best, and its covariance.

`gauss_newton.py`, `slide.py`, `covariance.py`.
"""
