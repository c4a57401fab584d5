"""Plug-ins of users: trackers, panels, faults and actions, a file each."""
