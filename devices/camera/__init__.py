"""Live 360° cameras: addresses, the streams they send, and the pictures received from them."""
