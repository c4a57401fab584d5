"""`nexus simulate ...`: cameras, headsets and datasets that are not there."""
