# pyright: standard
"""A user-supplied network of the "segment anything" kind as `Masks`; only its tensors are known.

Two files, as samexporter writes them for SAM 2. Encoder: `image` [1, 3, S, S] to `image_embed`,
`high_res_feats_0`, `high_res_feats_1`. Decoder: these and `point_coords` [1, N, 2], `point_labels`
[1, N], `mask_input` [1, 1, S/4, S/4], `has_mask_input` [1] to `masks` [1, M, h, w] of logits and
`iou_predictions` [1, M]. Weights are never part of this program.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import onnxruntime
from numpy.typing import NDArray

from scenes.prepare.cutout.marks.masks import Prompt

FloatArray = NDArray[np.float32]

FEATURES = ("image_embed", "high_res_feats_0", "high_res_feats_1")
DECODER_INPUTS = (*FEATURES, "point_coords", "point_labels", "mask_input", "has_mask_input")
DECODER_OUTPUTS = ("masks", "iou_predictions")
MEAN = np.array([0.485, 0.456, 0.406], dtype=np.float32)
"""Mean of the pictures that the network was trained on, RGB."""
DEVIATION = np.array([0.229, 0.224, 0.225], dtype=np.float32)
"""Of the pictures that these networks learned from, RGB 0..1."""
ON, BESIDE, TOP_LEFT, BOTTOM_RIGHT = 1.0, 0.0, 2.0, 3.0
"""Labels of points, as the decoder expects them."""


class SamMasks:
    """Masks by an encoder that looks at a picture once and a decoder that takes a prompt.

    Args:
        encoder: the ONNX file.
        decoder: of the same export; None for the file beside it whose name says "decoder" where
            the encoder's says "encoder".
        threads: of the inference; 0 leaves it to the runtime.

    Raises:
        ValueError: a file is missing, is no ONNX network, or its tensors are not those above.
    """

    def __init__(self, encoder: Path, decoder: Path | None = None, *, threads: int = 0) -> None:
        if decoder is None:
            decoder = _beside(encoder)
        self._encoder = _open(encoder, threads)
        self._decoder = _open(decoder, threads)
        _check(encoder, self._encoder, ("image",), FEATURES)
        _check(decoder, self._decoder, DECODER_INPUTS, DECODER_OUTPUTS)
        shape = next(i.shape for i in self._encoder.get_inputs() if i.name == "image")
        side = shape[-1]
        if not isinstance(side, int) or list(shape[1:]) != [3, side, side]:
            raise ValueError(
                f"{encoder}: its image is {shape}, wanted [1, 3, S, S]; give the encoder of a "
                "SAM 2 export"
            )
        self._side_px = side
        self._decoder_file = decoder

    def mask(self, picture: NDArray[np.uint8], prompt: Prompt) -> NDArray[np.bool_]:
        """See `Masks.mask`."""
        height, width = picture.shape[:2]
        points, labels = _as_points(prompt, width, height)
        scale = np.array([self._side_px / width, self._side_px / height])
        quarter = self._side_px // 4
        given: dict[str, FloatArray] = {
            **self._looked_at(picture),
            "point_coords": (points * scale)[None].astype(np.float32),
            "point_labels": labels[None],
            "mask_input": np.zeros((1, 1, quarter, quarter), np.float32),
            "has_mask_input": np.zeros(1, np.float32),
        }
        masks, scores = self._run(self._decoder, list(DECODER_OUTPUTS), given)
        if masks.ndim != 4 or scores.size != masks.shape[1] or not scores.size:
            raise ValueError(
                f"{self._decoder_file}: masks {masks.shape} and {scores.size} scores, wanted "
                "[1, M, h, w] and M; it is not a decoder of SAM 2"
            )
        best = masks[0, int(np.argmax(scores))]
        logits = cv2.resize(best, (width, height), interpolation=cv2.INTER_LINEAR)
        return np.asarray(logits > 0.0)

    def _looked_at(self, picture: NDArray[np.uint8]) -> dict[str, FloatArray]:
        side = (self._side_px, self._side_px)
        small = cv2.resize(picture, side, interpolation=cv2.INTER_AREA).astype(np.float32) / 255.0
        tensor = ((small - MEAN) / DEVIATION).transpose(2, 0, 1)[None]
        values = self._run(self._encoder, list(FEATURES), {"image": tensor})
        return dict(zip(FEATURES, values, strict=True))

    def _run(
        self, session: Any, wanted: list[str], given: dict[str, FloatArray]
    ) -> list[FloatArray]:
        types = {i.name: i.type for i in session.get_inputs()}
        half = {name: types[name] == "tensor(float16)" for name in given}
        fed = {n: v.astype(np.float16) if half[n] else np.float32(v) for n, v in given.items()}
        try:
            answers = session.run(wanted, fed)
        except Exception as error:  # the runtime has a dozen unrelated classes
            reason = str(error).splitlines()[0]
            raise ValueError(
                f"{self._decoder_file}: encoder and decoder do not fit together: {reason}"
            ) from error
        return [np.asarray(answer, dtype=np.float32) for answer in answers]


def _as_points(prompt: Prompt, width: int, height: int) -> tuple[NDArray[np.float64], FloatArray]:
    """(N, 2) pixels and (N,) what each says; a box is its two corners.

    Raises:
        ValueError: the box leaves nothing of the picture.
    """
    points, labels = [prompt.inside_px, prompt.outside_px], [ON] * len(prompt.inside_px)
    labels += [BESIDE] * len(prompt.outside_px)
    if prompt.box_px is not None:
        left, top = max(prompt.box_px[0], 0.0), max(prompt.box_px[1], 0.0)
        right, bottom = min(prompt.box_px[2], width), min(prompt.box_px[3], height)
        if right - left < 2 or bottom - top < 2:
            raise ValueError(
                f"box {tuple(round(v) for v in prompt.box_px)} px leaves nothing of the "
                f"{width}×{height} px picture; draw it around the object in this view"
            )
        points.append(np.array([[left, top], [right, bottom]]))
        labels += [TOP_LEFT, BOTTOM_RIGHT]
    return np.concatenate(points), np.array(labels, dtype=np.float32)


def _beside(encoder: Path) -> Path:
    if "encoder" not in encoder.name:
        raise ValueError(
            f"{encoder}: which file is its decoder? name the two …encoder….onnx and …decoder….onnx"
        )
    return encoder.with_name(encoder.name.replace("encoder", "decoder"))


def _open(file: Path, threads: int) -> Any:
    if not file.is_file():
        raise ValueError(f"{file}: no such file; give the encoder, with its decoder beside it")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(str(file), options, providers=["CPUExecutionProvider"])
    except Exception as error:  # the runtime has a dozen unrelated classes
        reason = str(error).splitlines()[0]
        raise ValueError(f"{file}: not a readable ONNX network: {reason}") from error


def _check(file: Path, session: Any, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> None:
    """Raises ValueError unless the network takes these inputs and gives at least these outputs."""
    takes = {i.name for i in session.get_inputs()}
    gives = {o.name for o in session.get_outputs()}
    if takes != set(inputs) or not gives >= set(outputs):
        raise ValueError(
            f"{file}: takes {', '.join(sorted(takes))} and gives {', '.join(sorted(gives))}; "
            f"wanted {', '.join(inputs)} and {', '.join(outputs)}, as SAM 2 exports have them"
        )
