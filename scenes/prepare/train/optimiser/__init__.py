"""One step after another: what is made small, by what, and how that changes on the way."""
