"""Build what is published: wheels for Linux and the source archive, into dist/.

    ./nexus wheel                      x86-64 and aarch64, and the source archive
    ./nexus wheel --target x86_64      one of them
    ./nexus wheel --here               this machine's only, by its own linker

It works on a copy of the files that Git knows: nothing else in the checkout gets into a wheel. It
adds `studio/bundled` to the copy: what an installed program needs of files outside the packages.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from studio.web.web_files import LICENCES, MODULES, fetch, is_complete  # noqa: E402

BUNDLED = "studio/bundled"
"""Folder in which `studio/console/program_files.py` looks for them."""

PAGES = (".md", ".png", ".jpg")
"""Parts of `docs/` that the manual in the window shows."""

GLIBC = "manylinux2014"
"""Oldest Linux that wheels run on; what they depend on wants a newer one (manylinux_2_28)."""

TARGETS = ("x86_64", "aarch64")


def main(words: Sequence[str] | None = None) -> None:
    """Build as the command line says, and name the files."""
    parser = argparse.ArgumentParser(description="Build wheels and the source archive.")
    parser.add_argument("--target", choices=TARGETS, action="append", help="(default: all)")
    parser.add_argument("--here", action="store_true", help="one wheel, for this machine only")
    parser.add_argument("--out", type=Path, default=ROOT / "dist", help="(default: dist)")
    args = parser.parse_args(words)
    out = args.out.resolve()
    # Outside the checkout, whose .gitignore maturin would follow.
    with tempfile.TemporaryDirectory(prefix="nexus-wheel-") as folder:
        copy = Path(folder)
        copy_sources(ROOT, copy)
        bundle(ROOT, copy / BUNDLED)
        if args.here:
            run_maturin(copy, ["build", "--release", "--locked", "--strip", "--out", str(out)])
        else:
            run_maturin(copy, ["sdist", "--out", str(out)])
            for target in args.target or TARGETS:
                run_maturin(copy, cross_build(target, out))
    for path in sorted(out.glob("gaussiannexus_studio-*")):
        print(f"{path.stat().st_size / 1e6:6.1f} MB  {path}")


def copy_sources(root: Path, folder: Path) -> None:
    """Copy every file that Git knows, as it is now."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=root, capture_output=True, check=True)
    for name in filter(None, listed.stdout.decode().split("\0")):
        if (root / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, folder / name)


def bundle(root: Path, folder: Path) -> None:
    """Copy manual, licence and the viewer's libraries with their licences into one folder.

    Raises:
        MissingWebFilesError: the libraries are not here, and npm could not fetch them.
    """
    web = root / "web"
    if not is_complete(web):
        fetch(web)
    modules = [Path("node_modules") / file for file in MODULES.values()]
    stated = [
        Path("node_modules") / package / name
        for package in LICENCES
        for name in ("package.json", "LICENSE")
    ]
    files = [Path("web") / each for each in (Path("package-lock.json"), *modules, *stated)]
    pages = [path for path in (root / "docs").rglob("*") if path.suffix in PAGES]
    files += [path.relative_to(root) for path in pages]
    for file in (Path("LICENSE"), *files):
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(root / file, folder / file)


def cross_build(target: str, out: Path) -> list[str]:
    """Words for maturin: Zig links for an old Linux, of another processor too."""
    triple = f"{target}-unknown-linux-gnu"
    if shutil.which("rustup"):
        subprocess.run(["rustup", "--quiet", "target", "add", triple], cwd=ROOT, check=True)
    options = ["--target", triple, "--zig", "--compatibility", GLIBC, "--out", str(out)]
    return ["build", "--release", "--locked", "--strip", *options]


def run_maturin(folder: Path, words: Sequence[str]) -> None:
    """Run maturin in a folder of sources; compiled crates are kept in the checkout.

    Raises:
        subprocess.CalledProcessError: it failed, and has said why.
    """
    environment = os.environ | {
        "CARGO_TARGET_DIR": os.environ.get("CARGO_TARGET_DIR", str(ROOT / "native" / "target")),
        "PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"])),
    }
    subprocess.run(
        [sys.executable, "-m", "maturin", *words], cwd=folder, env=environment, check=True
    )


if __name__ == "__main__":
    main()
