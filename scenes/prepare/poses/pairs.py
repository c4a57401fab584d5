# pyright: standard
"""Pairs of pictures to match: all with all, or neighbours and those that look alike."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

FloatArray = NDArray[np.float64]

WORDS = 32
"""Visual words of the vocabulary."""
TRAINING_DESCRIPTORS = 20_000
"""Descriptors that the vocabulary is made of."""
DESCRIPTORS_PER_PICTURE = 1_000
"""Descriptors of a picture that are counted, the strongest first."""

Pair = tuple[int, int]


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
