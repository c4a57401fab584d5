"""Simulated cameras on the wire: the bytes of real devices, on real sockets.

`rtmp_client.py` `flv_packets.py` (one that pushes); `preview_server.py`, `osc_server.py` with
`osc_camera.py` (Insta360); `accepting.py` (the port and the sending that they share);
`people_messages.py` (what people's clients send to a hub), `hostile.py` (damaged copies of any).
"""
