"""A camera that is asked over RTSP: requests, RTP packets, and the server that answers."""
