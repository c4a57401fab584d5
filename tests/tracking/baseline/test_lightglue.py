import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from tracking.baseline.lightglue import LightGlueMatcher

POINTS = np.array([[[10, 20], [30, 40], [50, 6]], [[12, 20], [32, 40], [5, 5]]], np.float32)
MATCHES = np.array([[0, 0, 0], [0, 1, 1], [0, 2, 2], [1, 0, 1]], np.int64)
SCORES = np.array([0.9, 0.8, 0.01, 0.9], np.float32)


def network(
    path, *, channels=3, sides=("h", "w"), matches=MATCHES, points=POINTS, names=None, asks="images"
):
    """A network that answers with the same points whatever it sees, plus the mean of its input."""
    names = names or ("keypoints", "matches", "mscores")
    values = (points, matches, SCORES[: len(matches)])
    zero = numpy_helper.from_array(np.zeros((), np.float32), "zero")
    nodes = [
        helper.make_node("ReduceMean", [asks], ["mean"], keepdims=0),
        helper.make_node("Mul", ["mean", "zero"], ["nothing"]),
        helper.make_node("Add", ["raw0", "nothing"], [names[0]]),
        helper.make_node("Identity", ["raw1"], [names[1]]),
        helper.make_node("Identity", ["raw2"], [names[2]]),
    ]
    graph = helper.make_graph(
        nodes,
        "tiny",
        [helper.make_tensor_value_info(asks, TensorProto.FLOAT, [2, channels, *sides])],
        [
            helper.make_tensor_value_info(names[0], TensorProto.FLOAT, None),
            helper.make_tensor_value_info(names[1], TensorProto.INT64, None),
            helper.make_tensor_value_info(names[2], TensorProto.FLOAT, None),
        ],
        [zero, *(numpy_helper.from_array(value, f"raw{k}") for k, value in enumerate(values))],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 9
    onnx.save(model, str(path))
    return path


def picture(height=96, width=160):
    return np.full((height, width, 3), 100, np.uint8)


@pytest.mark.parametrize("channels", [1, 3])
def test_certain_matches_of_the_pair_come_out_in_the_pictures_pixels(tmp_path, channels):
    matcher = LightGlueMatcher(network(tmp_path / "m.onnx", channels=channels))
    found = matcher.match(picture(), picture())
    # The uncertain one and the one of another pair are left out; centres are at .5 here.
    np.testing.assert_allclose(found.first, POINTS[0, :2] + 0.5)
    np.testing.assert_allclose(found.second, POINTS[1, :2] + 0.5)


def test_pictures_are_fitted_into_fixed_sides(tmp_path):
    matcher = LightGlueMatcher(network(tmp_path / "m.onnx", sides=(64, 64)))
    found = matcher.match(picture(128, 256), picture(128, 256))
    np.testing.assert_allclose(found.first, (POINTS[0, :2] + 0.5) * 4)


def test_large_pictures_are_shrunk_where_the_file_leaves_it_open(tmp_path):
    matcher = LightGlueMatcher(network(tmp_path / "m.onnx"))
    found = matcher.match(picture(512, 1024), picture(512, 1024))
    np.testing.assert_allclose(found.first, (POINTS[0, :2] + 0.5) * 2)


def test_no_matches_are_no_points(tmp_path):
    file = network(tmp_path / "m.onnx", matches=np.zeros((0, 3), np.int64))
    assert LightGlueMatcher(file).match(picture(), picture()).first.shape == (0, 2)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"channels": 4}, "inputs"),
        ({"asks": "image0"}, "inputs"),
        ({"names": ("keypoints", "matches0", "mscores")}, "lack matches"),
        ({"matches": MATCHES[:, :2]}, "wanted"),
        ({"matches": MATCHES + np.array([0, 9, 0])}, "limit 2"),
        ({"points": POINTS[:1]}, "wanted"),
    ],
)
def test_foreign_networks_are_refused_at_construction(tmp_path, options, message):
    with pytest.raises(ValueError, match=message):
        LightGlueMatcher(network(tmp_path / "m.onnx", **options))


def test_missing_and_damaged_files_are_refused_at_construction(tmp_path):
    with pytest.raises(ValueError, match="no such file"):
        LightGlueMatcher(tmp_path / "none.onnx")
    (tmp_path / "bad.onnx").write_bytes(b"this is no network")
    with pytest.raises(ValueError, match="not a readable ONNX network"):
        LightGlueMatcher(tmp_path / "bad.onnx")
