"""`nexus study ...`: a study from its file to its report."""
