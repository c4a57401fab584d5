"""The photos that a file of poses names, wherever it was written and however it spells them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from scenes.prepare.footage.capture import CaptureError, some_of

GUESSED_SUFFIXES = (".png", ".jpg", ".jpeg", ".JPG")
"""instant-ngp's own files leave the suffix out."""
MAX_LEFT_OUT_SHARE = 0.5
"""Of the photos that have a pose. If more of them cannot be used, it is the wrong folder or the
wrong file, and what is left shows no room."""


def find_photo(name: str, folders: Sequence[Path]) -> Path | None:
    """The file that is meant by a name, or None.

    It may be a path, with the separators of either system, and lack its suffix. It is looked for as
    it is named, then by fewer and fewer of its last parts, then in other capitals.

    Args:
        name: as the file of poses has it.
        folders: the likeliest first.
    """
    path = Path(name.replace("\\", "/"))
    tails = [path, *(Path(*path.parts[start:]) for start in range(1, len(path.parts)))]
    for tail in tails:
        for folder in folders:
            for suffix in ("", *GUESSED_SUFFIXES):
                candidate = folder / tail.with_name(tail.name + suffix)
                if candidate.is_file():
                    return candidate
    wanted = path.name.casefold()
    for folder in folders:
        if folder.is_dir():
            same = [file for file in folder.iterdir() if file.name.casefold() == wanted]
            if len(same) == 1:
                return same[0]
    return None


def check_left_out(source: Path, left_out: Sequence[str], count: int) -> None:
    """Refuse poses most of whose photos cannot be used.

    Args:
        source: the file of poses, or the photos' folder.
        left_out: a photo and what is wrong with it, each.
        count: photos with a pose.

    Raises:
        CaptureError: more are left out than `MAX_LEFT_OUT_SHARE`.
    """
    if len(left_out) > MAX_LEFT_OUT_SHARE * count:
        raise CaptureError(
            f"{source}: {len(left_out)} of {count} photos cannot be used "
            f"({some_of(left_out, '; ')}), at most {MAX_LEFT_OUT_SHARE:.0%} may be left out; give "
            "the folder that the poses were found with, or export them again"
        )
