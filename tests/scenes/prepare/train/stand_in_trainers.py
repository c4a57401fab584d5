"""Stand-ins for trainers that need a GPU: their command lines, files and traps, without training.

Each takes what its program documents and refuses anything else, reads the COLMAP folder, and leaves
splats that were trained before (`STAND_IN_SPLATS`) where and in the frame that the program would:

- gsplat `examples/simple_trainer.py`: `ply/point_cloud_{step}.ply` of the last step, counted from
  0; turned and scaled unless told otherwise; waits for its viewer at the end unless told otherwise.
- Brush: below `--export-path`, which it takes relative to the folder that the data lie in.
- OpenSplat: the file of `-o`; centred and scaled to a unit cube unless told otherwise.
- Inria `train.py`: `point_cloud/iteration_{n}/point_cloud.ply`.
"""

import argparse
import os
import struct
import sys
from dataclasses import replace
from pathlib import Path

from scenes.formats.registry import read_splats, write_splats


class Refusing(argparse.ArgumentParser):
    """Takes no flag that is not listed, nor one that is cut short."""

    def __init__(self, program):
        super().__init__(program, allow_abbrev=False)


def photos_in(data):
    """How many photos with poses a COLMAP folder holds; ends where a file is missing or wrong."""
    sparse = data / "sparse" / "0"
    counts = [
        struct.unpack("<Q", (sparse / name).read_bytes()[:8])[0]
        for name in ("cameras.bin", "images.bin", "points3D.bin")
    ]
    if counts[1] != len(list((data / "images").iterdir())) or not counts[2]:
        sys.exit(f"{data}: {counts} cameras, images and points do not fit its photos")
    return counts[1]


def trained(*, normalised=False):
    """Splats that were trained before, in the frame of the poses or in the program's own."""
    cloud = read_splats(Path(os.environ["STAND_IN_SPLATS"]))
    if not normalised:
        return cloud
    centre = cloud.means.mean(axis=0)
    scale = float(0.3 / abs(cloud.means - centre).max())
    return replace(cloud, means=(cloud.means - centre) * scale, scales=cloud.scales * scale)


def gsplat(words):
    parser = Refusing("simple_trainer.py")
    parser.add_argument("strategy", choices=("default", "mcmc"))
    for flag in ("--data_dir", "--result_dir"):
        parser.add_argument(flag, type=Path, required=True)
    for flag in ("--data_factor", "--max_steps", "--sh_degree", "--test_every"):
        parser.add_argument(flag, type=int)
    parser.add_argument("--strategy.cap-max", type=int)
    parser.add_argument("--ply_steps", type=int, nargs="+")
    for flag in ("--save_ply", "--no-normalize-world-space", "--disable_viewer", "--disable_video"):
        parser.add_argument(flag, action="store_true")
    told = parser.parse_args(words)
    photos_in(told.data_dir)
    if told.data_factor != 1:
        sys.exit(f"Image folder {told.data_dir}/images_{told.data_factor} does not exist.")
    last = told.max_steps - 1
    print(f"loss=0.03| sh degree={told.sh_degree}| : 50%| {told.max_steps // 2}/{told.max_steps}")
    if told.save_ply and last in [step - 1 for step in told.ply_steps]:
        (told.result_dir / "ply").mkdir(parents=True)
        write_splats(
            told.result_dir / "ply" / f"point_cloud_{last}.ply",
            trained(normalised=not told.no_normalize_world_space),
        )
    if not told.disable_viewer:
        sys.exit("Viewer running... Ctrl+C to exit.")


def brush(words):
    parser = Refusing("brush")
    parser.add_argument("source", type=Path)
    for flag in ("--total-train-iters", "--max-splats", "--sh-degree", "--export-every", "--seed"):
        parser.add_argument(flag, type=int)
    parser.add_argument("--export-path", type=Path, default=Path("exports"))
    parser.add_argument("--export-name", default="export_{iter}.ply")
    told = parser.parse_args(words)
    photos_in(told.source)
    folder = told.source.parent / told.export_path
    folder.mkdir(parents=True, exist_ok=True)
    count = told.total_train_iters
    print(f"[00:00:10] {count // 2:>7}/{count:7} Steps (90/s, 3s remaining)")
    write_splats(folder / told.export_name.replace("{iter}", str(count)), trained())


def opensplat(words):
    parser = Refusing("opensplat")
    parser.add_argument("input", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("splat.ply"))
    for flags in (("-n", "--num-iters"), ("--sh-degree",), ("--max-gaussians",)):
        parser.add_argument(*flags, type=int)
    parser.add_argument("--keep-crs", action="store_true")
    told = parser.parse_args(words)
    photos_in(told.input)
    if told.sh_degree < 1:
        sys.exit("the degree must be > 0")
    print(f"Step {told.num_iters // 2}: 0.0312 [50%]")
    write_splats(told.output, trained(normalised=not told.keep_crs))


def inria(words):
    parser = Refusing("train.py")
    parser.add_argument("-s", "--source_path", type=Path, required=True)
    parser.add_argument("-m", "--model_path", type=Path, required=True)
    for flag in ("--iterations", "--sh_degree"):
        parser.add_argument(flag, type=int)
    parser.add_argument("--save_iterations", type=int, nargs="+", default=[])
    parser.add_argument("--disable_viewer", action="store_true")
    told = parser.parse_args(words)
    photos_in(told.source_path)
    for count in {*told.save_iterations, told.iterations}:
        folder = told.model_path / "point_cloud" / f"iteration_{count}"
        folder.mkdir(parents=True)
        write_splats(folder / "point_cloud.ply", trained())


if __name__ == "__main__":
    {"gsplat": gsplat, "brush": brush, "opensplat": opensplat, "inria": inria}[sys.argv[1]](
        sys.argv[2:]
    )
