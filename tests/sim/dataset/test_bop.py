"""`sim.dataset.bop`: the files that BOP's toolkit asks for."""

import json
import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest

from scenes.pose import Pose
from sim.dataset.bop import model_numbers
from sim.dataset.check import check_bop, check_dataset


def _json(path):
    return json.loads(path.read_text())


def test_what_is_written_agrees_with_the_models(bop_folder):
    folder, written = bop_folder
    assert (written.frames, written.photos) == (3, 0)
    assert check_dataset(folder) == written.checked
    assert written.checked.form == "bop"
    assert written.checked.images == 18
    assert written.checked.iou_worst > 0.93
    assert written.checked.length_mm < 2.0


def test_every_scene_has_the_files_of_the_form(bop_folder):
    folder, _ = bop_folder
    scenes = sorted((folder / "test").iterdir())
    assert [scene.name for scene in scenes] == [f"{n:06d}" for n in range(6)]
    targets = _json(folder / "test_targets_bop19.json")
    assert targets
    size = _json(folder / "camera.json")
    for scene in scenes:
        cameras, poses = _json(scene / "scene_camera.json"), _json(scene / "scene_gt.json")
        infos = _json(scene / "scene_gt_info.json")
        assert list(cameras) == ["0", "2", "4"]
        for image, instances in poses.items():
            assert (scene / "rgb" / f"{int(image):06d}.jpg").is_file()
            depth = cv2.imread(str(scene / f"depth/{int(image):06d}.png"), cv2.IMREAD_UNCHANGED)
            assert depth.dtype == np.uint16
            assert depth.shape == (size["height"], size["width"])
            for index, (instance, info) in enumerate(zip(instances, infos[image], strict=True)):
                mask = cv2.imread(
                    str(scene / f"mask/{int(image):06d}_{index:06d}.png"), cv2.IMREAD_UNCHANGED
                )
                assert np.count_nonzero(mask) == info["px_count_all"]
                x, y, w, h = info["bbox_obj"]
                assert mask[y : y + h, x : x + w].any(axis=0).all()
                assert np.count_nonzero(mask[y : y + h, x : x + w]) == info["px_count_all"]
                assert np.linalg.norm(instance["cam_t_m2c"]) > 500  # mm


def test_an_object_s_centre_projects_into_its_box(bop_folder):
    folder, _ = bop_folder
    infos = _json(folder / "models/models_info.json")
    compared = 0
    for scene in (folder / "test").iterdir():
        cameras, poses = _json(scene / "scene_camera.json"), _json(scene / "scene_gt.json")
        for image, instances in poses.items():
            k = np.array(cameras[image]["cam_K"]).reshape(3, 3)
            seen = _json(scene / "scene_gt_info.json")[image]
            for instance, info in zip(instances, seen, strict=True):
                model = infos[str(instance["obj_id"])]
                middle = [model[f"min_{a}"] + 0.5 * model[f"size_{a}"] for a in "xyz"]
                rotation = np.array(instance["cam_R_m2c"]).reshape(3, 3)
                point = k @ (rotation @ middle + instance["cam_t_m2c"])
                x, y, w, h = info["bbox_obj"]
                edge = 2 * k[0, 2] - 2
                if x < 2 or y < 2 or x + w > edge or y + h > edge:
                    continue
                u, v = point[:2] / point[2]
                assert x < u < x + w
                assert y < v < y + h
                compared += 1
    assert compared >= 3


def test_cameras_lie_where_the_lens_is(small_room, bop_folder):
    folder, _ = bop_folder
    for scene in range(3):
        camera = _json(folder / f"test/{scene:06d}/scene_camera.json")["0"]
        rotation = np.array(camera["cam_R_w2c"]).reshape(3, 3)
        centre = -rotation.T @ np.array(camera["cam_t_w2c"]) / 1000
        np.testing.assert_allclose(centre, small_room.world_from_rig.translation, atol=1e-6)


def test_twins_share_a_model(small_room):
    chair, book = small_room.objects
    twin = replace(chair, object_id="chair-2", world_from_object=Pose.identity())
    red = replace(
        twin,
        object_id="chair-3",
        meshes=tuple(replace(m, texture=m.texture // 2) for m in twin.meshes),
    )
    assert list(model_numbers([chair, book, twin, red]).values()) == [1, 2, 1, 3]


def test_a_wrong_translation_is_found(bop_folder, tmp_path):
    shutil.copytree(bop_folder[0], tmp_path / "set")
    path = tmp_path / "set/test/000000/scene_gt.json"
    values = _json(path)
    for instances in values.values():
        for instance in instances:
            instance["cam_t_m2c"][0] += 60.0
    path.write_text(json.dumps(values))
    with pytest.raises(ValueError, match="overlap"):
        check_bop(tmp_path / "set").require(tmp_path / "set")
