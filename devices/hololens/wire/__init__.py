"""Bytes of a HoloLens on the network: every message as a layout, with its reader and its writer.

Little endian, packed, in the headset's own units and axes; nothing is interpreted here. `taking.py`
(where bytes come from, and what is refused), `packets.py` (packets of streams), and a port a file:
`personal_video.py`, `spatial_input.py`, `spatial_mapping.py` with `surface_mesh.py`,
`remote_configuration.py`, `message_queue.py`.
"""
