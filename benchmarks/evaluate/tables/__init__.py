"""One module a table of `nexus evaluate`, and what some of them share."""
