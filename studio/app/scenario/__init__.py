"""The scenario editor: people on the floor, actions on time, faults as knobs, and the text."""
