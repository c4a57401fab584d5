"""Hostile bytes and failing networks, against parsers, clients and servers."""
