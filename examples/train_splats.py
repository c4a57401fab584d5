"""Train splats on a few dozen photos whose poses are known, and draw one that was kept aside.

    .venv/bin/python examples/train_splats.py --out out/trained

A simulated phone films the built-in desk; `--photos FOLDER --poses FILE` takes your own photos and
a transforms.json or COLMAP model instead. `./nexus prepare` does all this and more: it finds the
poses, the scale and the floor as well. Leaves splats.ply, which any viewer opens, and
compared.png: the photo on the left, the splats on the right.
"""

import argparse
import time
from pathlib import Path

import cv2
import numpy as np

from scenes.formats.registry import write_splats
from scenes.pose import Pose
from scenes.prepare.poses.given_poses import import_poses
from scenes.prepare.progress import silent
from scenes.prepare.reconstruction import read_picture
from scenes.prepare.train.train import BuiltInTrainer
from scenes.prepare.train.trainer import TrainingOptions
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.samples import sample_room
from sim.phone.phone import PhoneOptions, film


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--photos", type=Path, help="your photos' folder (default: film the desk)")
    parser.add_argument("--poses", type=Path, help="their transforms.json or COLMAP model")
    parser.add_argument("--frames", type=int, default=40, help="photos to film")
    parser.add_argument("--steps", type=int, default=800, help="of training")
    args = parser.parse_args()

    args.out.mkdir(parents=True, exist_ok=True)
    photos, poses = args.photos, args.poses
    if photos is None:
        options = PhoneOptions(frames=args.frames, width_px=400, height_px=300, samples=1)
        film(sample_room("desk"), args.out, rng=np.random.default_rng(0), options=options)
        photos, poses = args.out / "images", args.out / "truth" / "transforms.json"
    reconstruction = import_poses(poses, photos, args.out / "work")
    print(
        f"{len(reconstruction.views)} photos, {len(reconstruction.points):,} points to start from"
    )

    trainer = BuiltInTrainer(
        TrainingOptions(seconds=None, iterations=args.steps, budget=40_000, previews=0),
        rng=lambda: np.random.default_rng(0),
        stopwatch=time.perf_counter,
    )
    result = trainer.train(reconstruction, args.out / "work", progress=silent)
    print(f"{len(result.cloud):,} splats; photos kept aside are drawn with {result.psnr_db:.1f} dB")
    write_splats(args.out / "splats.ply", result.cloud)

    view = next(view for view in reconstruction.views if view.name == result.held_out[0].view)
    drawn = NativeRenderer().render(
        [PosedSplats(result.cloud, Pose.identity())], view.camera, view.world_from_camera
    )
    rgb = np.clip(255 * drawn.rgb + 0.5, 0, 255).astype(np.uint8)
    compared = np.hstack([read_picture(view), rgb])
    cv2.imwrite(str(args.out / "compared.png"), compared[..., ::-1])


if __name__ == "__main__":
    main()
