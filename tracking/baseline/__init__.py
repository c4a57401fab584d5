"""The paper's chain (section 4.4) with its own constants, kept as the baseline."""

import os

# The networks' runtime would keep an id of the user, report its use and leave a file behind; it
# asks this variable once, when it is imported.
os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
