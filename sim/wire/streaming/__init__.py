"""A film on real sockets: the camera that plays it, and one output a protocol."""
