"""Threads and processes beside the caller: one protocol of progress, cancelling and errors."""
