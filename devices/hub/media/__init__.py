"""Voice between people, and what live surfaces show as video: by WebRTC, else over the WebSocket.

In the hub's process: `voice_wire.py` (a moment of voice in bytes), `floor.py` (who is heard of
those who speak), `voice_room.py` (voices in, to each listener and to the recording), `signals.py`
(what a client says about its media), `offer.py` (an offer of WebRTC read, and written anew for our
side), `link.py` (the process of its own in which WebRTC runs, begun by the first offer). In that
process: `process.py` (its messages), `peers.py` (one connection a person), `tracks.py` (voices and
pictures on their way out), `pictures.py` (a surface encoded once for everybody); `frames.py` (what
both sides write to their pipes). WebRTC, the extra `people-media`, is loaded by that process alone.
"""
