# pyright: standard
"""A user-supplied YOLO11-seg network as a `Detector`; only its tensors are known here.

Input `images` [1, 3, S, S], RGB / 255, letterboxed with 114. `output0` [1, 4 + nc + 32, A]: centre,
size, class scores and mask coefficients per anchor; `output1` [1, 32, S/4, S/4]: mask prototypes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import onnxruntime
from numpy.typing import NDArray

from tracking.baseline.detect import Detection, Expected
from tracking.baseline.rectify import RectifiedView

FloatArray = NDArray[np.float32]

MASK_CHANNELS = 32
PAD_VALUE = 114
MIN_SCORE = 0.25
LARGEST_OVERLAP = 0.45


@dataclass(frozen=True, slots=True)
class Letterbox:
    """How a picture was fitted into the network's square: `network = scale · picture + pad`."""

    scale: float
    pad_x: int
    pad_y: int
    size_px: int


class YoloSegDetector:
    """Detects with a YOLO11-seg ONNX file.

    Args:
        path: the file.
        class_names: label per class, by default "0", "1", ...
        threads: of the inference; 0 leaves it to the runtime.

    Raises:
        ValueError: the file is missing, is no ONNX network, or its tensors are not those of a
            YOLO11-seg export.
    """

    def __init__(
        self, path: Path | str, *, class_names: Sequence[str] = (), threads: int = 0
    ) -> None:
        file = Path(path)
        if not file.is_file():
            raise ValueError(f"YOLO model {file}: no such file; give the path of a *-seg.onnx")
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        options.log_severity_level = 4
        try:
            session = onnxruntime.InferenceSession(
                str(file), options, providers=["CPUExecutionProvider"]
            )
        except Exception as error:  # the runtime has a dozen unrelated classes
            reason = str(error).splitlines()[0]
            raise ValueError(f"YOLO model {file}: not a readable ONNX network: {reason}") from error
        self._session = session
        self._size, self._input_name, self._dtype = _check_input(file, session)
        self._classes = _check_outputs(file, session)
        if class_names and len(class_names) != self._classes:
            raise ValueError(
                f"YOLO model {file}: {len(class_names)} class names for {self._classes} classes"
            )
        self._names = tuple(class_names) or tuple(str(i) for i in range(self._classes))

    def detect(self, view: RectifiedView, expected: Sequence[Expected]) -> tuple[Detection, ...]:
        """All classes found, best first; `expected` is not needed."""
        del expected
        tensor, box = letterbox(view.image, self._size)
        raw = self._session.run(None, {self._input_name: tensor.astype(self._dtype)})
        predictions, prototypes = (np.asarray(r, dtype=np.float32)[0] for r in raw[:2])
        height, width = view.image.shape[:2]
        return decode(predictions, prototypes, box, (width, height), self._names)


def letterbox(image: NDArray[np.uint8], size_px: int) -> tuple[FloatArray, Letterbox]:
    """(H, W, 3) picture -> ([1, 3, S, S] float32 0..1, how it was fitted)."""
    height, width = image.shape[:2]
    scale = min(size_px / width, size_px / height)
    new_width, new_height = round(width * scale), round(height * scale)
    pad_x, pad_y = (size_px - new_width) // 2, (size_px - new_height) // 2
    square = np.full((size_px, size_px, 3), PAD_VALUE, np.uint8)
    resized = cv2.resize(image, (new_width, new_height), interpolation=cv2.INTER_LINEAR)
    square[pad_y : pad_y + new_height, pad_x : pad_x + new_width] = resized
    tensor = square.transpose(2, 0, 1)[None].astype(np.float32) / 255.0
    return tensor, Letterbox(scale, pad_x, pad_y, size_px)


def decode(
    predictions: FloatArray,
    prototypes: FloatArray,
    box: Letterbox,
    picture_size_px: tuple[int, int],
    names: Sequence[str],
) -> tuple[Detection, ...]:
    """Network output to detections in the picture.

    Args:
        predictions: (4 + nc + 32, A).
        prototypes: (32, S/4, S/4).
        box: of `letterbox`.
        picture_size_px: (width, height) of the picture.
        names: label per class.
    """
    rows = predictions.T
    scores = rows[:, 4 : 4 + len(names)]
    best = scores.argmax(axis=1)
    score = scores[np.arange(len(rows)), best]
    kept = np.flatnonzero(score >= MIN_SCORE)
    if kept.size == 0:
        return ()
    centre, size = rows[kept, :2], rows[kept, 2:4]
    corners = np.concatenate([centre - 0.5 * size, centre + 0.5 * size], axis=1)
    corners = corners.astype(np.float32)
    left_over = suppress(corners, score[kept], best[kept])
    found = []
    for i in left_over:
        row = kept[i]
        mask, clipped = _mask(
            rows[row, -MASK_CHANNELS:], prototypes, corners[i], box, picture_size_px
        )
        if mask.any():
            found.append(Detection(names[int(best[row])], float(score[row]), clipped, mask))
    return tuple(found)


def suppress(corners: FloatArray, scores: FloatArray, classes: NDArray[np.integer]) -> list[int]:
    """Non-maximum suppression per class: indices of the boxes to keep, best first."""
    order = list(np.argsort(-scores, kind="stable"))
    keep: list[int] = []
    while order:
        first = int(order.pop(0))
        keep.append(first)
        order = [
            i
            for i in order
            if classes[i] != classes[first]
            or _overlap(corners[i], corners[first]) <= LARGEST_OVERLAP
        ]
    return keep


def _overlap(a: FloatArray, b: FloatArray) -> float:
    """Intersection over union of two (4,) corner boxes."""
    side = np.maximum(np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2]), 0.0)
    shared = float(side.prod())
    union = float((a[2:] - a[:2]).prod() + (b[2:] - b[:2]).prod()) - shared
    return shared / union if union > 0 else 0.0


def _mask(
    coefficients: FloatArray,
    prototypes: FloatArray,
    corners: FloatArray,
    box: Letterbox,
    picture_size_px: tuple[int, int],
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """The (H, W) mask inside its box, and the (4,) box, in the picture."""
    width, height = picture_size_px
    logits = np.tensordot(coefficients, prototypes, axes=1).astype(np.float32)
    shrink = logits.shape[1] / box.size_px
    x = ((np.arange(width) + 0.5) * box.scale + box.pad_x) * shrink - 0.5
    y = ((np.arange(height) + 0.5) * box.scale + box.pad_y) * shrink - 0.5
    map_x, map_y = np.meshgrid(x.astype(np.float32), y.astype(np.float32))
    upsampled = cv2.remap(logits, map_x, map_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    pad = np.array([box.pad_x, box.pad_y, box.pad_x, box.pad_y])
    clipped = (corners.astype(np.float64) - pad) / box.scale
    clipped = np.clip(clipped, 0, [width, height, width, height])
    mask = upsampled > 0.0
    columns = np.arange(width) + 0.5
    rows = np.arange(height) + 0.5
    mask &= (columns >= clipped[0]) & (columns <= clipped[2])
    mask &= ((rows >= clipped[1]) & (rows <= clipped[3]))[:, None]
    return mask, clipped


def _check_input(
    file: Path, session: onnxruntime.InferenceSession
) -> tuple[int, str, type[np.floating]]:
    inputs = session.get_inputs()
    shape = list(inputs[0].shape) if inputs else []
    types: dict[str, type[np.floating]] = {
        "tensor(float)": np.float32,
        "tensor(float16)": np.float16,
    }
    square = len(shape) == 4 and isinstance(shape[2], int) and shape[1:] == [3, shape[2], shape[2]]
    if len(inputs) != 1 or not square or inputs[0].type not in types:
        got = [(i.name, i.shape, i.type) for i in inputs]
        raise ValueError(
            f"YOLO model {file}: inputs {got}, wanted one [1, 3, S, S] of float or float16"
        )
    return shape[2], inputs[0].name, types[inputs[0].type]


def _check_outputs(file: Path, session: onnxruntime.InferenceSession) -> int:
    """Number of classes."""
    shapes = [list(o.shape) for o in session.get_outputs()]
    good = (
        len(shapes) >= 2
        and len(shapes[0]) == 3
        and len(shapes[1]) == 4
        and isinstance(shapes[0][1], int)
        and shapes[0][1] > 4 + MASK_CHANNELS
        and shapes[1][1] == MASK_CHANNELS
    )
    if not good:
        raise ValueError(
            f"YOLO model {file}: outputs {shapes}, wanted [1, 4 + classes + 32, anchors] and "
            "[1, 32, S/4, S/4]: export a *-seg network without built-in NMS"
        )
    return shapes[0][1] - 4 - MASK_CHANNELS
