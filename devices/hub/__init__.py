"""The hub: people elsewhere join the live room over HTTPS and a WebSocket, each with a role.

`roles.py` (who may do what), `wire.py` (head, hands and controllers in bytes), `server.py` (who is
here, what they get and send).
"""
