"""`archive.zip`: everything of a session in one file, with the digest of every file in it."""

from __future__ import annotations

import hashlib
import json
import threading
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

from studio.console.machine import program_version
from studio.session.pipeline import CancelledError

MANIFEST, DIGESTS = "manifest.json", "SHA256SUMS"
FORMAT_VERSION = 1
BLOCK_BYTES = 1 << 20

PACKED_ALREADY = frozenset({".mp4", ".mcap", ".jpg", ".jpeg", ".png", ".zip", ".spz"})
"""Files that a second packing makes no smaller."""


def write_archive(
    path: Path,
    files: dict[str, Path],
    *,
    cancelled: threading.Event,
    reached: Callable[[float, str], None] = lambda _share, _name: None,
) -> None:
    """Write a ZIP file of these files, a block of a megabyte in memory at a time.

    At its end are `manifest.json` (name, size and SHA-256 of every file) and `SHA256SUMS`, which
    `sha256sum -c` reads.

    Args:
        path: the archive.
        files: where each file lies, by its name in the archive.
        cancelled: set it from another thread to stop.
        reached: sees the share of bytes that are in, and the file that is being added.

    Raises:
        CancelledError: it was cancelled.
        OSError: a file cannot be read, or the disk is full.
    """
    whole = sum(file.stat().st_size for file in files.values())
    done = 0
    entries: list[dict[str, object]] = []
    with zipfile.ZipFile(path, "w", allowZip64=True) as archive:
        for name, file in sorted(files.items()):
            entry = zipfile.ZipInfo.from_file(file, name, strict_timestamps=False)
            packs = file.suffix.lower() not in PACKED_ALREADY
            entry.compress_type = zipfile.ZIP_DEFLATED if packs else zipfile.ZIP_STORED
            digest, size = hashlib.sha256(), 0
            with archive.open(entry, "w", force_zip64=True) as target:
                for block in _blocks(file):
                    if cancelled.is_set():
                        raise CancelledError
                    target.write(block)
                    digest.update(block)
                    size += len(block)
                    done += len(block)
                    reached(done / max(whole, 1), name)
            entries.append({"path": name, "bytes": size, "sha256": digest.hexdigest()})
        manifest = {
            "format": "gaussiannexus archive",
            "version": FORMAT_VERSION,
            "program": f"GaussianNexus Studio {program_version()}",
            "files": entries,
        }
        sums = "".join(f"{entry['sha256']}  {entry['path']}\n" for entry in entries)
        archive.writestr(MANIFEST, json.dumps(manifest, indent=2) + "\n", zipfile.ZIP_DEFLATED)
        archive.writestr(DIGESTS, sums, zipfile.ZIP_DEFLATED)


def _blocks(file: Path) -> Iterator[bytes]:
    with file.open("rb") as source:
        while block := source.read(BLOCK_BYTES):
            yield block
