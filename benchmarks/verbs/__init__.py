"""One file a verb of `nexus bench` and `nexus evaluate`, and the table of them."""
