"""Ends of the studio: clocks, messages, streams, adapters, recording. No algorithms."""
