# pyright: standard
"""Features of every picture, and which of them are the same in two pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pycolmap
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

from scenes.prepare.poses.sfm.code_matches import drop_mixed_codes, sheets_in
from scenes.prepare.poses.sfm.session import Refused, Worker, open_database

PICTURES_AT_ONCE = 8
"""Pictures between two reports of progress."""

PAIRS_AT_ONCE = 60
"""Pairs between two reports of progress."""

FOCAL_OVER_LONGEST = 0.85
"""Of a phone's main camera, for pictures that do not state theirs."""

FloatArray = NDArray[np.float64]

WORDS = 32
"""Visual words of the vocabulary."""

TRAINING_DESCRIPTORS = 20_000
"""Descriptors that the vocabulary is made of."""

DESCRIPTORS_PER_PICTURE = 1_000
"""Descriptors of a picture that are counted, the strongest first."""

Pair = tuple[int, int]


def extract(worker: Worker) -> None:
    """SIFT features of every picture; pictures of one lens share a camera."""
    job, o = worker.job, worker.job.options
    options = pycolmap.FeatureExtractionOptions()
    options.type = pycolmap.FeatureExtractorType.SIFT
    options.num_threads = o.threads
    options.max_image_size = o.longest_px
    options.sift.max_num_features = o.features
    options.sift.first_octave = -1 if o.finest else 0
    lenses = list(dict.fromkeys(picture.lens for picture in job.pictures))
    count = 0
    for lens in lenses:
        pictures = [picture for picture in job.pictures if picture.lens == lens]
        focals = [p.focal_px for p in pictures if p.focal_px]
        for start in range(0, len(pictures), PICTURES_AT_ONCE):
            names = [p.name for p in pictures[start : start + PICTURES_AT_ONCE]]
            reader = pycolmap.ImageReaderOptions()
            given = pictures[0].known
            reader.camera_model = "PINHOLE" if given else o.lens
            reader.default_focal_length_factor = FOCAL_OVER_LONGEST
            known = _camera_of(worker, pictures)
            if known is not None:
                reader.existing_camera_id = known
            elif given:
                reader.camera_params = ",".join(repr(value) for value in given.pinhole)
            elif focals:
                path = job.pictures_folder / pictures[0].name
                reader.camera_params = _start_values(
                    reader.camera_model, path, float(np.median(focals))
                )
            pycolmap.extract_features(
                worker.database,
                job.pictures_folder,
                names,
                pycolmap.CameraMode.SINGLE,
                reader,
                options,
                pycolmap.Device.cpu,
            )
            count += len(names)
            worker.report(
                "extraction", count / len(job.pictures), f"features: {count}/{len(job.pictures)}"
            )


def _start_values(model: str, path: Path, focal_px: float) -> str:
    camera = pycolmap.Camera.create(
        0, getattr(pycolmap.CameraModelId, model), focal_px, *_size(path)
    )
    return camera.params_to_string()


def _size(path: Path) -> tuple[int, int]:
    bitmap = pycolmap.Bitmap.read(path, as_rgb=False)
    if bitmap is None:
        raise Refused(f"{path}: no picture that can be read; gather the pictures again")
    return bitmap.width, bitmap.height


def _camera_of(worker: Worker, pictures: Sequence[Any]) -> int | None:
    """The camera that an already extracted picture of the same lens has."""
    if not worker.database.exists():
        return None
    with open_database(worker.database) as database:
        for picture in pictures:
            image = database.read_image_with_name(picture.name)
            if image is not None:
                return int(image.camera_id)
    return None


def match(worker: Worker) -> None:
    """SIFT matches and two-view geometry of the chosen pairs; pairs done before are skipped."""
    job = worker.job
    names = [picture.name for picture in job.pictures]
    worker.report("matching", 0.0, "which pictures look alike")
    sheets = sheets_in(job.pictures_folder, names)
    pairs = _choose_pairs(worker)
    options = pycolmap.FeatureMatchingOptions()
    options.type = pycolmap.FeatureMatcherType.SIFT_BRUTEFORCE
    options.num_threads = job.options.threads
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = job.options.seed
    pairing = pycolmap.ImportedPairingOptions()
    pairing.match_list_path = job.work / "pairs.txt"
    for start in range(0, len(pairs), PAIRS_AT_ONCE):
        block = [(names[i], names[j]) for i, j in pairs[start : start + PAIRS_AT_ONCE]]
        _write_pairs(pairing.match_list_path, block)
        pycolmap.match_image_pairs(
            worker.database, options, pairing, verification, pycolmap.Device.cpu
        )
        with open_database(worker.database) as database:
            changed = drop_mixed_codes(database, block, sheets=sheets)
        if changed:
            _write_pairs(pairing.match_list_path, changed)
            pycolmap.verify_matches(worker.database, pairing.match_list_path, verification)
        done = min(len(pairs), start + PAIRS_AT_ONCE)
        worker.report("matching", done / len(pairs), f"matching: {done}/{len(pairs)} pairs")


def _write_pairs(path: Path, pairs: Sequence[tuple[str, str]]) -> None:
    path.write_text("\n".join(" ".join(pair) for pair in pairs), encoding="utf-8")


def _choose_pairs(worker: Worker) -> list[Pair]:
    job, o = worker.job, worker.job.options
    count = len(job.pictures)
    few = count <= o.exhaustive_up_to
    if o.matching == "exhaustive" or (o.matching == "auto" and few):
        pairs = all_pairs(count)
    else:
        near = neighbour_pairs(count, o.neighbours) if job.ordered else []
        each = o.similar if job.ordered else o.similar + o.neighbours
        with open_database(worker.database) as database:
            ids = [database.read_image_with_name(p.name).image_id for p in job.pictures]
            descriptors = [np.asarray(database.read_descriptors(i).data) for i in ids]
        signatures = picture_signatures(descriptors, np.random.default_rng(o.seed))
        apart = o.neighbours + 1 if job.ordered else 1
        far = similar_pairs(signatures, each, apart=apart)
        pairs = list(dict.fromkeys([*near, *far]))
    return sorted(pairs, key=lambda pair: (pair[0] // PICTURES_AT_ONCE, pair[1]))


def all_pairs(count: int) -> list[Pair]:
    """Every pair (i < j) of `count` pictures, near ones first."""
    return [(i, i + step) for step in range(1, count) for i in range(count - step)]


def neighbour_pairs(count: int, reach: int) -> list[Pair]:
    """Pairs of pictures up to `reach` apart in the order they were taken, and 2, 4, 8 … times that.

    The farther ones catch a camera that turned to and fro.
    """
    steps = list(range(1, reach + 1))
    while steps and steps[-1] * 2 < min(count, 8 * reach):
        steps.append(steps[-1] * 2)
    return [(i, i + step) for step in steps for i in range(count - step)]


def similar_pairs(signatures: FloatArray, each: int, *, apart: int = 1) -> list[Pair]:
    """Pairs of pictures that look alike: the `each` nearest of every picture.

    Args:
        signatures: (N, D) unit vectors, as `picture_signatures` gives them.
        each: how many partners a picture proposes.
        apart: pictures nearer than this in order are no proposal.
    """
    count = len(signatures)
    similarity = signatures @ signatures.T
    order = np.arange(count)
    similarity[np.abs(order[:, None] - order[None, :]) < apart] = -np.inf
    pairs: set[Pair] = set()
    for i in range(count):
        best = np.argsort(-similarity[i], kind="stable")[:each]
        pairs |= {(min(i, int(j)), max(i, int(j))) for j in best if np.isfinite(similarity[i, j])}
    return sorted(pairs)


def picture_signatures(
    descriptors: Sequence[NDArray[np.uint8]], rng: np.random.Generator
) -> FloatArray:
    """One unit vector per picture from its SIFT descriptors; alike pictures get alike vectors.

    VLAD (Jégou et al. 2010) with power normalisation over words learned from the capture itself, so
    no vocabulary has to be downloaded.

    Args:
        descriptors: (n, 128) uint8 per picture; strongest features first.
        rng: source of the sampling.
    """
    used = [_take_roots(d[:DESCRIPTORS_PER_PICTURE]) for d in descriptors]
    pool = np.concatenate(used)
    if len(pool) < WORDS:
        return np.zeros((len(descriptors), WORDS))
    sample = pool[rng.permutation(len(pool))[:TRAINING_DESCRIPTORS]]
    words, _ = kmeans2(sample, WORDS, iter=12, minit="points", rng=rng)
    signatures = np.zeros((len(used), WORDS * pool.shape[1]))
    for number, features in enumerate(used):
        if not len(features):
            continue
        nearest = np.argmax(features @ words.T - 0.5 * (words**2).sum(axis=1), axis=1)
        sums = np.zeros_like(words)
        np.add.at(sums, nearest, features - words[nearest])
        flat = (np.sign(sums) * np.sqrt(np.abs(sums))).ravel()
        signatures[number] = flat / max(float(np.linalg.norm(flat)), 1e-12)
    return signatures


def _take_roots(descriptors: NDArray[np.uint8]) -> FloatArray:
    values = descriptors.astype(np.float64)
    return values / np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1e-12)
