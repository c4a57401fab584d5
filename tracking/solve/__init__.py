"""The pose that fits a window best, and its covariance."""
