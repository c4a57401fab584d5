import os
import subprocess
import sys

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from scenes.cameras import Pinhole
from scenes.pose import Pose
from tracking.baseline.rectify import RectifiedView
from tracking.baseline.yolo import Letterbox, YoloSegDetector, decode, letterbox, suppress

SIZE = 64
ANCHORS = 6
CLASSES = ("chair", "cache")
CHANNELS = 4 + 2 + 32


def network(path, *, channels=CHANNELS, prototypes=32, boxes=None):
    """A network that ignores its picture and always answers with the same two tensors."""
    rows = np.zeros((1, channels, ANCHORS), np.float32)
    protos = np.zeros((1, prototypes, SIZE // 4, SIZE // 4), np.float32)
    for anchor, (box, label, score) in enumerate(boxes or []):
        rows[0, :4, anchor] = box
        rows[0, 4 + label, anchor] = score
        rows[0, 4 + len(CLASSES), anchor] = 1.0
    # The first prototype is a disc in the middle of the network's picture.
    y, x = np.mgrid[0 : SIZE // 4, 0 : SIZE // 4] + 0.5
    protos[0, 0] = 6.0 - np.hypot(x - SIZE / 8, y - SIZE / 8)
    constants = [
        helper.make_node("Constant", [], [name], value=numpy_helper.from_array(value, name))
        for name, value in (("output0", rows), ("output1", protos))
    ]
    graph = helper.make_graph(
        constants,
        "tiny",
        [helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, 3, SIZE, SIZE])],
        [
            helper.make_tensor_value_info("output0", TensorProto.FLOAT, rows.shape),
            helper.make_tensor_value_info("output1", TensorProto.FLOAT, protos.shape),
        ],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 9
    onnx.save(model, str(path))
    return path


def view(width=128, height=64):
    image = np.zeros((height, width, 3), np.uint8)
    camera = Pinhole.from_fov(width, height, 1.0)
    valid = np.ones((height, width), bool)
    return RectifiedView(image, camera, Pose.identity(), None, valid)


def test_detects_through_a_real_onnx_session(tmp_path):
    boxes = [
        ((32, 32, 40, 20), 0, 0.9),
        ((33, 32, 40, 20), 0, 0.8),
        ((32, 32, 40, 20), 1, 0.7),
        ((10, 32, 10, 10), 1, 0.1),
    ]
    detector = YoloSegDetector(network(tmp_path / "n.onnx", boxes=boxes), class_names=CLASSES)
    found = detector.detect(view(), ())
    assert [(d.label, round(d.score, 2)) for d in found] == [("chair", 0.9), ("cache", 0.7)]
    # 128×64 shrinks by 2 into the middle rows of the 64×64 square: x' = 2x, y' = 2(y - 16).
    np.testing.assert_allclose(found[0].box_px, [24, 12, 104, 52], atol=1e-4)
    mask = found[0].mask
    assert mask.shape == (64, 128)
    rows, columns = np.nonzero(mask)
    # The disc of radius 6 prototype pixels is one of 48 px in the picture, cut to the box.
    assert columns.min() in (24, 25)
    assert columns.max() in (102, 103)
    assert (rows.min(), rows.max()) == (12, 51)


def test_nothing_found_is_an_empty_answer(tmp_path):
    assert YoloSegDetector(network(tmp_path / "n.onnx")).detect(view(), ()) == ()


def test_letterbox_keeps_the_aspect_and_pads_with_114():
    tensor, box = letterbox(np.full((100, 200, 3), 255, np.uint8), 64)
    assert tensor.shape == (1, 3, 64, 64)
    assert box == Letterbox(0.32, 0, 16, 64)
    assert tensor[0, 0, 0, 0] == pytest.approx(114 / 255)
    assert tensor[0, 0, 32, 32] == 1.0


def test_upright_pictures_are_padded_at_the_sides():
    _, box = letterbox(np.zeros((200, 100, 3), np.uint8), 64)
    predictions = np.zeros((4 + 1 + 32, 1), np.float32)
    predictions[:5, 0] = (32, 32, 16, 32, 1.0)
    predictions[5, 0] = 1.0
    protos = np.zeros((32, 16, 16), np.float32)
    protos[0] = 1.0
    (found,) = decode(predictions, protos, box, (100, 200), ("physical",))
    np.testing.assert_allclose(found.box_px, [25, 50, 75, 150])
    assert found.mask.sum() == 50 * 100


def test_suppression_is_per_class_and_keeps_the_best():
    corners = np.array(
        [[0, 0, 10, 10], [1, 0, 11, 10], [20, 0, 30, 10], [0, 0, 10, 10]], np.float32
    )
    scores = np.array([0.5, 0.9, 0.3, 0.4], np.float32)
    assert suppress(corners, scores, np.array([0, 0, 0, 1])) == [1, 3, 2]


@pytest.mark.parametrize(
    ("options", "message"),
    [({"channels": 30}, "outputs"), ({"prototypes": 16}, "outputs")],
)
def test_foreign_networks_are_refused_at_construction(tmp_path, options, message):
    with pytest.raises(ValueError, match=message):
        YoloSegDetector(network(tmp_path / "n.onnx", **options))


def test_missing_and_damaged_files_are_refused_at_construction(tmp_path):
    with pytest.raises(ValueError, match="no such file"):
        YoloSegDetector(tmp_path / "none.onnx")
    (tmp_path / "bad.onnx").write_bytes(b"this is no network")
    with pytest.raises(ValueError, match="not a readable ONNX network"):
        YoloSegDetector(tmp_path / "bad.onnx")
    good = network(tmp_path / "n.onnx")
    with pytest.raises(ValueError, match="3 class names for 2 classes"):
        YoloSegDetector(good, class_names=("a", "b", "c"))


def test_the_runtime_of_networks_reports_nothing_and_leaves_nothing(tmp_path):
    environment = {k: v for k, v in os.environ.items() if k != "ORT_DISABLE_TELEMETRY"}
    subprocess.run(
        [sys.executable, "-c", "import tracking.baseline.yolo"],
        check=True,
        env={**environment, "TMPDIR": str(tmp_path)},
    )
    assert list(tmp_path.iterdir()) == []
