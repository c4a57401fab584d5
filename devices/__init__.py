"""Ends of the studio: clocks, messages, streams, adapters, recording. No algorithms.

`clock.py` `messages.py` `streams.py` (time, what travels, how it waits); `clock_mapping.py` (a
device's clock on the session's); `video.py` `footage.py` `video_files.py` (H.264, recorded 360°
video); `recording.py` on `recording_codec.py` and `recorded/`, `replay.py` (MCAP);
`packet_pictures.py` `packet_runs.py` (recorded packets to pictures: one by one, several at once);
`session_info.py` (what a recording says of itself).
"""
