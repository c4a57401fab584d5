"""`nexus sites ...`: rooms of several sites, and what connects them."""
