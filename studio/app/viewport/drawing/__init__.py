"""Drawing of views, to pixels."""
