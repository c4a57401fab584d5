"""The app: command line, sessions, reports, windows; no algorithms."""
