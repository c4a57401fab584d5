"""The paper's chain (section 4.4) with its own constants, kept as the baseline."""
