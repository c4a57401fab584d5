"""Films: what a simulated camera shows, drawn and encoded once, with the truth of every picture."""
