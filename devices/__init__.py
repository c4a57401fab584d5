"""Where data enters and leaves: clocks, messages, streams, adapters, recording. No algorithms."""
