"""Simulated cameras on the wire: the bytes of real devices, on real sockets."""
