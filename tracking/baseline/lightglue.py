# pyright: standard
"""A user-supplied extractor with LightGlue in one ONNX file as a `Matcher`.

Only its tensors are known here, as LightGlue-ONNX writes them end to end for SuperPoint, DISK and
ALIKED. Input `images` [2, C, H, W]: the two pictures, 0..1, grey (C = 1) or RGB (C = 3). Outputs
`keypoints` [2, K, 2]: x, y in pixels of the input, the first centre at 0; `matches` [M, 3]: pair,
index in the first, index in the second picture; `mscores` [M]. Weights are never part of this
program, and SuperPoint's may be used for research only.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import onnxruntime
from numpy.typing import NDArray

from tracking.baseline.matcher import Matches

FloatArray = NDArray[np.float32]

OUTPUTS = ("keypoints", "matches", "mscores")
MULTIPLE_PX = 32
"""Sides of the input, where the file leaves them open: what every known extractor can take."""

LONGEST_SIDE_PX = 512
"""Of the input, where the file leaves it open: larger takes seconds on a laptop."""

MIN_SCORE = 0.1


class LightGlueMatcher:
    """Matches with an ONNX file.

    Args:
        path: the file.
        threads: of the inference; 0 leaves it to the runtime.

    Raises:
        ValueError: the file is missing, is no ONNX network, its tensors are not those above, or
            it fails on a trial picture.
    """

    def __init__(self, path: Path | str, *, threads: int = 0) -> None:
        self._file = Path(path)
        if not self._file.is_file():
            raise ValueError(
                f"matcher {self._file}: no such file; give the path of an end-to-end *.onnx"
            )
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        options.log_severity_level = 4
        try:
            self._session = onnxruntime.InferenceSession(
                str(self._file), options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:  # the runtime has a dozen unrelated classes
            reason = str(error).splitlines()[0]
            raise ValueError(
                f"matcher {self._file}: not a readable ONNX network: {reason}"
            ) from error
        self._channels, self._sides, self._dtype = self._checked()
        trial = np.random.default_rng(0).integers(0, 256, (96, 128, 3)).astype(np.uint8)
        try:
            self.match(trial, trial)
        except ValueError:
            raise
        except Exception as error:
            reason = str(error).splitlines()[0]
            raise ValueError(f"matcher {self._file}: fails on a trial picture: {reason}") from error

    def match(self, first: NDArray[np.uint8], second: NDArray[np.uint8]) -> Matches:
        """Points of two (H, W, 3) RGB pictures of the same size.

        Raises:
            ValueError: the network's answer is not what its file announced.
        """
        pictures = [self._as_input(picture) for picture in (first, second)]
        scale = pictures[0][1]
        images = np.stack([picture for picture, _ in pictures]).astype(self._dtype)
        answer = self._session.run(list(OUTPUTS), {"images": images})
        keypoints, matches, scores = (np.asarray(part) for part in answer)
        good = (
            keypoints.ndim == 3
            and (keypoints.shape[0], keypoints.shape[2]) == (2, 2)
            and matches.ndim == 2
            and matches.shape[1] == 3
            and scores.shape == matches.shape[:1]
        )
        if not good:
            shapes = [part.shape for part in (keypoints, matches, scores)]
            raise ValueError(
                f"matcher {self._file}: answered with {shapes}, wanted [2, K, 2], [M, 3] and [M]"
            )
        of_pair = matches[(matches[:, 0] == 0) & (scores >= MIN_SCORE), 1:].astype(np.intp)
        if of_pair.size and not (of_pair.min() >= 0 and of_pair.max() < keypoints.shape[1]):
            raise ValueError(
                f"matcher {self._file}: matches point {of_pair.max()}, limit "
                f"{keypoints.shape[1] - 1}: wanted rows of pair, first and second index"
            )
        found = [
            (keypoints[side, of_pair[:, side]].astype(np.float64) + 0.5) / scale for side in (0, 1)
        ]
        return Matches(found[0], found[1])

    def _as_input(self, picture: NDArray[np.uint8]) -> tuple[FloatArray, float]:
        """(C, H, W) 0..1, shrunk or grown to fit and padded, and its pixels per picture's pixel."""
        height, width = picture.shape[:2]
        if self._sides is None:
            scale = min(1.0, LONGEST_SIDE_PX / max(height, width))
            sides = [
                -(-round(side * scale) // MULTIPLE_PX) * MULTIPLE_PX for side in (height, width)
            ]
        else:
            sides = list(self._sides)
            scale = min(sides[0] / height, sides[1] / width)
        shrunk = scale < 1.0
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        fitted = cv2.resize(
            picture, size, interpolation=cv2.INTER_AREA if shrunk else cv2.INTER_LINEAR
        )
        padded = np.zeros((*sides, 3), np.uint8)
        padded[: size[1], : size[0]] = fitted
        if self._channels == 1:
            return cv2.cvtColor(padded, cv2.COLOR_RGB2GRAY)[None].astype(np.float32) / 255.0, scale
        return padded.transpose(2, 0, 1).astype(np.float32) / 255.0, scale

    def _checked(self) -> tuple[int, tuple[int, int] | None, type[np.floating]]:
        """Channels, sides (height, width) or None where the file leaves them open, input type."""
        inputs = self._session.get_inputs()
        outputs = [output.name for output in self._session.get_outputs()]
        types: dict[str, type[np.floating]] = {
            "tensor(float)": np.float32,
            "tensor(float16)": np.float16,
        }
        shape = list(inputs[0].shape) if inputs else []
        good = (
            [i.name for i in inputs] == ["images"]
            and inputs[0].type in types
            and len(shape) == 4
            and (shape[0] == 2 or not isinstance(shape[0], int))
            and shape[1] in (1, 3)
        )
        if not good:
            got = [(i.name, i.shape, i.type) for i in inputs]
            raise ValueError(
                f"matcher {self._file}: inputs {got}, wanted one images [2, 1 or 3, H, W] of "
                "float or float16: export extractor and LightGlue end to end"
            )
        missing = [name for name in OUTPUTS if name not in outputs]
        if missing:
            raise ValueError(
                f"matcher {self._file}: outputs {outputs} lack {', '.join(missing)}: export "
                "extractor and LightGlue end to end"
            )
        fixed = isinstance(shape[2], int) and isinstance(shape[3], int)
        return shape[1], (shape[2], shape[3]) if fixed else None, types[inputs[0].type]
