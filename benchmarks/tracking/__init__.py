"""Parts of the tracker on labelled windows of random rooms: likelihood, proposals."""
