"""A network of a few nodes that answers as SAM 2 would: what is bright is the thing."""

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from scenes.prepare.cutout.marks.masks import Prompt
from scenes.prepare.cutout.marks.sam_masks import SamMasks

SIDE = 32
QUARTER = SIDE // 4


def saved(path, nodes, inputs, outputs, constants=()):
    def info(name, shape):
        return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)

    graph = helper.make_graph(
        nodes,
        "tiny",
        [info(*i) for i in inputs],
        [info(*o) for o in outputs],
        [numpy_helper.from_array(np.asarray(value), name) for name, value in constants],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 9
    onnx.save(model, str(path))


def encoder(path, *, image=("image", [1, 3, SIDE, SIDE])):
    """Gives the picture back as its embedding."""
    names = ("image_embed", "high_res_feats_0", "high_res_feats_1")
    saved(
        path,
        [helper.make_node("Identity", [image[0]], [name]) for name in names],
        [image],
        [(name, [1, 3, SIDE, SIDE]) for name in names],
    )
    return path


def decoder(path, *, embed=3, drop=()):
    """Three masks: brightness, its opposite, all. The scores are the labels it was told."""
    inputs = [
        ("image_embed", [1, embed, SIDE, SIDE]),
        ("high_res_feats_0", [1, embed, SIDE, SIDE]),
        ("high_res_feats_1", [1, embed, SIDE, SIDE]),
        ("point_coords", [1, "n", 2]),
        ("point_labels", [1, "n"]),
        ("mask_input", [1, 1, QUARTER, QUARTER]),
        ("has_mask_input", [1]),
    ]
    nodes = [
        helper.make_node("ReduceMean", ["image_embed"], ["light"], axes=[1], keepdims=1),
        helper.make_node("Neg", ["light"], ["dark"]),
        helper.make_node("Abs", ["light"], ["all"]),
        helper.make_node("Concat", ["light", "dark", "all"], ["masks"], axis=1),
        helper.make_node("Slice", ["point_labels", "zero", "three", "one"], ["iou_predictions"]),
    ]
    constants = [
        ("zero", np.array([0], np.int64)),
        ("three", np.array([3], np.int64)),
        ("one", np.array([1], np.int64)),
    ]
    outputs = [("masks", [1, 3, SIDE, SIDE]), ("iou_predictions", [1, "m"])]
    saved(path, nodes, [i for i in inputs if i[0] not in drop], outputs, constants)
    return path


@pytest.fixture
def files(tmp_path):
    return encoder(tmp_path / "tiny.encoder.onnx"), decoder(tmp_path / "tiny.decoder.onnx")


def picture_of_a_lamp():
    picture = np.full((48, 96, 3), 20, np.uint8)
    picture[12:36, 24:60] = 240
    return picture, picture[..., 0] > 128


def test_the_best_scored_mask_comes_back_in_the_pictures_size(files):
    picture, bright = picture_of_a_lamp()
    # Labels are (on, beside, beside): the first mask scores best.
    lamp = Prompt(inside_px=np.array([[40.0, 20.0]]), outside_px=np.array([[2.0, 2.0], [90, 40]]))
    found = SamMasks(files[0]).mask(picture, lamp)
    assert (found.shape, found.dtype) == ((48, 96), np.bool_)
    assert (found & bright).sum() / (found | bright).sum() > 0.9
    # With a box behind two points, its first corner's label, 2, is the third and scores best.
    boxed = Prompt((20.0, 10.0, 64.0, 40.0), np.array([[40.0, 20.0], [41, 21]]))
    assert SamMasks(*files).mask(picture, boxed).all()


def test_a_box_outside_the_picture_is_refused(files):
    with pytest.raises(ValueError, match="leaves nothing of the 96×48 px picture"):
        SamMasks(files[0]).mask(picture_of_a_lamp()[0], Prompt((100.0, 0.0, 120.0, 40.0)))


def test_missing_and_wrong_files_are_named(files, tmp_path):
    with pytest.raises(ValueError, match=r"none\.encoder\.onnx: no such file"):
        SamMasks(tmp_path / "none.encoder.onnx")
    with pytest.raises(ValueError, match="which file is its decoder"):
        SamMasks(tmp_path / "sam.onnx")
    junk = tmp_path / "junk.encoder.onnx"
    junk.write_bytes(b"this is no network")
    with pytest.raises(ValueError, match=r"junk\.encoder\.onnx: not a readable ONNX network"):
        SamMasks(junk, files[1])
    with pytest.raises(ValueError, match=r"tiny\.decoder\.onnx: takes .* wanted image"):
        SamMasks(files[1], files[0])
    with pytest.raises(ValueError, match="wanted image_embed"):
        SamMasks(files[0], decoder(tmp_path / "less.onnx", drop=("mask_input",)))


def test_an_encoder_of_another_shape_is_refused(files, tmp_path):
    wide = encoder(tmp_path / "wide.onnx", image=("image", [1, 3, SIDE, 2 * SIDE]))
    with pytest.raises(ValueError, match=r"wide\.onnx: its image is .*wanted \[1, 3, S, S\]"):
        SamMasks(wide, files[1])
    other = decoder(tmp_path / "other.onnx", embed=4)
    with pytest.raises(ValueError, match="do not fit together"):
        SamMasks(files[0], other).mask(picture_of_a_lamp()[0], Prompt((20.0, 10.0, 64.0, 40.0)))
