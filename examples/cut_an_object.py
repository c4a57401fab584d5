"""Cut a chair out of a room's splats with one box in each of three views, and see what is left.

    .venv/bin/python examples/cut_an_object.py --out cut.png

The chair of the built-in room is first put back among the room's splats, as a preparation would
leave it. The boxes are those that a person would draw: around the whole object. `./nexus cut` does
the same with a package on disk. Left the room before, right after the cut.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from scenes.harmonics import turned
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.prepare.cutout.cutout import cut_marked
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import concatenate
from studio.verbs.cutting.cut import prompted_views, prompts_of

PAD_PX = 6.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="lab")
    parser.add_argument("--object", default="chair-1")
    parser.add_argument("--views", type=int, default=24, help="of the room's to use")
    parser.add_argument("--out", type=Path, required=True, metavar="PICTURE.png")
    args = parser.parse_args()

    scene = open_scene(args.scene)
    item = scene.object_by_id(args.object)
    in_world = turned(item.splats, item.world_from_object)
    scene = replace(scene, room=concatenate([scene.room, in_world]), objects=())

    boxes = {}
    for view in scene.views:
        camera_from_world = view.world_from_camera.inverse()
        pixels, valid = view.camera.project(camera_from_world @ in_world.means.astype(np.float64))
        if valid.all():
            boxes[view.name] = [*(pixels.min(axis=0) - PAD_PX), *(pixels.max(axis=0) + PAD_PX)]

    # Views that show it at a third of their height: three are marked, the others only looked at.
    def off_third(name: str) -> float:
        return abs((boxes[name][3] - boxes[name][1]) / scene.views[0].camera.height_px - 1 / 3)

    chosen = sorted(boxes, key=off_third)[: args.views]
    scene = replace(scene, views=tuple(view for view in scene.views if view.name in chosen))
    prompts = prompts_of([[name, *map(str, boxes[name])] for name in chosen[:3]], [], [])
    renderer = NativeRenderer()
    done = cut_marked(
        scene,
        prompted_views(scene, prompts, None),
        object_id="chair",
        name="Chair",
        kind="chair",
        renderer=renderer,
    )
    size_cm = " × ".join(f"{100 * side:.1f}" for side in done.item.box_m)
    print(f"{len(done.item.splats):,} of {len(in_world):,} splats, {size_cm} cm")

    view = next(view for view in scene.views if view.name == chosen[0])
    pictures = [
        renderer.render([PosedSplats(room, Pose.identity())], view.camera, view.world_from_camera)
        for room in (scene.room, done.package.room)
    ]
    both = np.clip(255 * np.hstack([picture.rgb for picture in pictures]), 0, 255).astype(np.uint8)
    cv2.imwrite(str(args.out), both[..., ::-1])


if __name__ == "__main__":
    main()
