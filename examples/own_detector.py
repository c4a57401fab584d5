"""Write a detector of your own and give it to the paper's tracking method.

    ./nexus rehearse --scenario lab-short --headless --out out/demo
    .venv/bin/python examples/own_detector.py out/demo/recording.mcap --out detected.png

A detector has one method (`tracking.baseline.detect.Detector`): a rectified picture in, boxes and
masks out. It may use what is expected, or ignore it as a trained network does. This one takes all
that is dark grey for a chair; the method's identity layer says which one is which. The picture
shows the masks of the last frame.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from devices.replay import ReplayCamera
from scenes.opening import open_scene
from scenes.render.native import NativeRenderer
from scenes.warp import warp
from tracking.baseline.detect import Detection, Expected
from tracking.baseline.paper import PaperTracker
from tracking.baseline.rectify import RectifiedView

LEAST_PX = 150


class DarkGreyDetector:
    """Takes what is dark and grey for a chair, whatever is expected."""

    def detect(self, view: RectifiedView, expected: Sequence[Expected]) -> tuple[Detection, ...]:
        """One detection per dark grey part of the picture, such as a chair of the built-in lab."""
        rgb = cv2.medianBlur(view.image, 3).astype(np.int16)
        is_dark, is_grey = rgb.mean(axis=2) < 112, np.ptp(rgb, axis=2) < 16
        mask = (is_dark & is_grey & view.valid).astype(np.uint8)
        mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
        count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
        found = []
        for number in range(1, count):
            left, top, width, height, area_px = (int(v) for v in stats[number])
            if area_px >= LEAST_PX:
                box_px = np.array([left, top, left + width, top + height], np.float64)
                found.append(Detection("chair", 0.5, box_px, labels == number))
        return tuple(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--out", type=Path, required=True, metavar="PICTURE.png")
    args = parser.parse_args()

    camera = ReplayCamera(args.recording)
    scene = open_scene(camera.session.scene)
    method = PaperTracker(scene.room, scene.objects, NativeRenderer(), detector=DarkGreyDetector())
    state, frame = method.start(), None
    for frame in camera.frames():
        state, _ = method.step(state, frame, frame.received_ns)
    if frame is None or state.view is None:
        raise SystemExit(f"{args.recording}: not a single picture in it")

    picture = np.array(warp(frame.images[state.view.lens], state.view.table))[..., ::-1].copy()
    for number, (object_id, track) in enumerate(sorted(state.tracks_2d.items())):
        print(f"{object_id:10} {track.visibility}")
        if track.detection is not None:
            colour = np.array([(64, 255, 64), (255, 128, 0), (0, 128, 255)][number % 3])
            picture[track.detection.mask] = picture[track.detection.mask] // 2 + colour // 2
    cv2.imwrite(str(args.out), picture)


if __name__ == "__main__":
    main()
