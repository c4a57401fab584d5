"""What is arranged by hand is what a rehearsal begins with, and its recorded text says so."""

import numpy as np
import pytest

from devices.recording import read_session
from scenes.coloured_mesh import Geometry
from scenes.pose import Pose
from studio.app.model.documents.added_mesh import AddedMesh
from studio.app.model.documents.arranged import arranged_text, mass_kg
from studio.app.model.documents.document import Primitive, TwinEdits
from studio.session.opening import open_session
from studio.session.plan import SessionPlan
from studio.session.records.recorded_scene import recorded_scene
from studio.session.staging import staging_of

CHAIR = Pose.from_yaw(0.7, (0.4, -0.9, 0.0))
RED, GREEN = (0.9, 0.1, 0.1), (0.1, 0.9, 0.1)
BOX = Primitive("box-1", "box", (0.4, 0.3, 0.5), RED, Pose.from_yaw(0.2, (1.0, -1.0, 0)))
BALL = Primitive("ball-1", "ball", (0.3, 0.3, 0.3), GREEN, Pose.from_yaw(0, (1.4, -1, 0)))


def wedge():
    corners = np.array([[0, 0, 0], [0.4, 0, 0], [0, 0.4, 0], [0, 0, 0.4]], np.float32)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    return AddedMesh(
        "mesh-1",
        "wedge.obj",
        Geometry(corners, faces, np.full((4, 3), 99, np.uint8)),
        Pose.from_yaw(0.0, (-1.0, -1.2, 0.0)),
    )


@pytest.fixture(scope="module")
def twin():
    mesh = wedge()
    return TwinEdits(
        poses={"chair-1": CHAIR},
        primitives={"box-1": BOX, "ball-1": BALL},
        meshes={"mesh-1": mesh},
    )


@pytest.fixture(scope="module")
def staged(twin):
    return staging_of("lab", "lab-short", arranged=arranged_text(twin))


def test_the_room_that_is_played_is_the_one_that_was_arranged(staged, twin):
    room = staged.room
    assert room.object_by_id("chair-1").world_from_object.matrix() == pytest.approx(
        CHAIR.matrix(), abs=1e-6
    )
    box, ball, mesh = (room.object_by_id(key) for key in ("box-1", "ball-1", "mesh-1"))
    assert box.mass_kg == pytest.approx(mass_kg(BOX))
    assert ball.mass_kg == pytest.approx(mass_kg(BALL))
    assert mesh.box_m == pytest.approx((0.4, 0.4, 0.4))
    assert mesh.parts
    assert box.world_from_object.matrix() == pytest.approx(
        BOX.world_from_primitive.matrix(), abs=1e-6
    )
    assert box.meshes[0].bounds() == pytest.approx(np.array([[-0.2, -0.15, 0.0], [0.2, 0.15, 0.5]]))


def test_the_text_that_is_recorded_says_so(staged):
    assert staged.scenario_text.count("[[arranged]]") == 1
    assert staged.scenario_text.count("[[added]]") == 3
    assert "Arranged by hand in the studio" in staged.scenario_text


def test_a_tilted_pose_comes_back_as_it_was():
    from scenes.pose import rotation_from_vector
    from sim.scenarios.scenario import recorded_arrangement

    tilted = Pose(rotation_from_vector(np.array([0.3, -0.8, 2.9])), np.array([0.1, 0.2, 0.3]))
    text = arranged_text(TwinEdits(poses={"a": tilted}))
    read = recorded_arrangement(text, source="test").poses["a"]
    assert read.matrix() == pytest.approx(tilted.matrix(), abs=1e-6)


def test_nothing_arranged_changes_nothing():
    assert arranged_text(TwinEdits()) == ""


def test_the_camera_sees_what_was_added_and_the_tracker_begins_where_it_was_put(twin, tmp_path):
    """A second of the lab, drawn for real: the recording opens with the same scene."""
    text = 'room = "lab"\nduration_s = 0.2\n[camera]\nlens_size_px = 160\nfps = 10\n'
    file = tmp_path / "short.toml"
    file.write_text(text)
    red = {}
    for name, arranged in (("as scanned", ""), ("arranged", arranged_text(twin))):
        plan = SessionPlan(
            scenario=str(file),
            methods=("own",),
            record_to=tmp_path / f"{name}.mcap",
            arranged=arranged,
        )
        session, outputs = open_session(plan), []
        session.run(outputs.append)
        picture = outputs[0].input.frame.images[0].astype(int)
        red[name] = int(((picture[..., 0] > 2 * picture[..., 1]) & (picture[..., 0] > 60)).sum())
        shown = next(t for t in outputs[0].shown.objects if t.object_id == "chair-1")
        truth = outputs[0].message.truth.recorded.world_from_object["chair-1"]
        off_m = np.linalg.norm(shown.world_from_object.translation - truth.translation)
        assert off_m < 0.1
    assert red["arranged"] > red["as scanned"] + 20
    info = read_session(tmp_path / "arranged.mcap")
    assert recorded_scene(info).object_by_id("chair-1").world_from_object.matrix() == pytest.approx(
        CHAIR.matrix(), abs=1e-6
    )
    again = open_session(SessionPlan(recording=tmp_path / "arranged.mcap", methods=("own",)))
    assert again.run(lambda _output: None).frames == 2
