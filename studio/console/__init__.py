"""Printed output of all verbs: rows of figures, progress, the machine."""
