"""From what a person marks in a view to the mask of one object."""
