"""An RTSP server of GStreamer, run by the system's Python.

Arguments: width, height, pictures a second, and a port if it is not to be any free one.
Prints its port once it serves `rtsp://127.0.0.1:PORT/camera`; leaves when standard input ends.
"""

import sys
import threading

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer  # noqa: E402

PIPELINE = (
    "( videotestsrc is-live=true pattern=ball ! video/x-raw,width={0},height={1},framerate={2}/1 "
    "! x264enc tune=zerolatency speed-preset=ultrafast key-int-max={2} threads=1 "
    "! rtph264pay name=pay0 pt=96 config-interval=-1 )"
)


def main():
    width, height, fps = sys.argv[1:4]
    port = sys.argv[4] if len(sys.argv) > 4 else "0"
    Gst.init(None)
    server = GstRtspServer.RTSPServer()
    server.set_address("127.0.0.1")
    server.set_service(port)
    factory = GstRtspServer.RTSPMediaFactory()
    factory.set_launch(PIPELINE.format(width, height, fps))
    factory.set_shared(True)
    server.get_mount_points().add_factory("/camera", factory)
    loop = GLib.MainLoop()
    if not server.attach(None):
        sys.exit("the port is taken")
    print(server.get_bound_port(), flush=True)
    threading.Thread(target=lambda: (sys.stdin.read(), loop.quit()), daemon=True).start()
    loop.run()


main()
