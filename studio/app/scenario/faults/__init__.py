"""Faults as knobs, and what they do to the tracker."""
