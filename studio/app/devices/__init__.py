"""The session panel: devices, checks before the start, delays, log, report."""
