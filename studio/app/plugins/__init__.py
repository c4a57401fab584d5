"""What users add to the studio: trackers, panels, faults and actions, a file each."""
