"""The twin drawn for people: overlays, live surfaces, orbits."""
