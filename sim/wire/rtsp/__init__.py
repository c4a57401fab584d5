"""A camera that is asked over RTSP: requests, RTP packets, and the server that answers.

`requests.py` `transport.py` (what players say), `packets.py` (RTP, RTCP, SDP), `senders.py` (over
TCP, over UDP), `server.py`.
"""
