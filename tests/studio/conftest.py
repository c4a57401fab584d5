"""A tiny room, a camera that looks at it, and trackers with a known error: no simulator needed."""

import importlib.util
import os
from pathlib import Path
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest

from devices.clock import ManualClock, WallClock
from devices.messages import Event, Frame
from devices.recording_codec import RecordedTruth
from devices.session_info import SessionInfo
from devices.video import H264Decoder, H264Encoder, side_by_side, split_lenses
from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS, look_at
from scenes.opening import open_scene
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.splats import SplatCloud
from scenes.state import Avatar, ObjectModel, TrackedObject, TrackState
from sim.truth import GroundTruth
from studio.session.opening import scene_hash
from studio.session.pipeline import ExactExecutor, PacedExecutor, SessionInput, SessionMessage
from studio.session.plan import Pace
from studio.session.session import Session
from studio.web.web_files import WEB, MissingWebFilesError, fetch, web_modules
from tracking.output import TrackOutput

LENS_PX, FRAMES, FPS = 64, 12, 10
LENS = Fisheye.from_fov(LENS_PX, np.radians(200))
RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))
SCENARIO = 'room = "tiny"\nduration_s = 1.2\n[camera]\nfps = 10\n'
CHAIR_STARTS, HIDDEN = 3, range(6, 9)


def make_cloud(rng, low, high, count):
    means = rng.uniform(low, high, (count, 3))
    return SplatCloud(
        means.astype(np.float32),
        np.full((count, 3), 0.05, np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        np.full(count, 0.9, np.float32),
        rng.normal(0, 0.8, (count, 1, 3)).astype(np.float32),
    )


def make_scene():
    rng = np.random.default_rng(5)
    objects = tuple(
        ObjectModel(
            object_id,
            name,
            kind,
            make_cloud(rng, (-0.2, -0.2, 0), (0.2, 0.2, 0.8), 40),
            (0.4, 0.4, 0.8),
            0.0,
            Pose.from_yaw(0.3, place),
        )
        for object_id, name, kind, place in (
            ("chair-1", "Chair 1", "chair", (0.5, 0.5, 0.0)),
            ("stool-1", "Stool 1", "stool", (-0.5, 0.8, 0.0)),
        )
    )
    rig = look_at(np.array([0.0, -1.0, 1.3]), np.array([0.0, 1.0, 1.3]))
    return ScenePackage(
        name="tiny",
        room=make_cloud(rng, (-2, -2, -0.02), (2, 2, 0.02), 300),
        objects=objects,
        codes=(),
        world_from_rig=rig,
        footprint_m=np.array([[-2.0, -2.0], [2.0, 2.0]]),
        physical=None,
    )


def true_poses(scene, seq):
    poses = {item.object_id: item.world_from_object for item in scene.objects}
    moved = max(0, seq - CHAIR_STARTS + 1) * 0.05
    start = poses["chair-1"]
    poses["chair-1"] = Pose.from_yaw(
        start.yaw() + moved, start.translation + np.array([moved, 0, 0])
    )
    return poses


def make_inputs(scene):
    rng = np.random.default_rng(1)
    encoder, decoder = H264Encoder(2 * LENS_PX, LENS_PX, FPS, 500_000), H264Decoder()
    for seq in range(FRAMES):
        t_ns = seq * 10**9 // FPS
        pictures = rng.integers(0, 256, (2, LENS_PX, LENS_PX, 3)).astype(np.uint8)
        packet = encoder.encode(side_by_side(list(pictures)), seq, t_ns)[0]
        lenses = split_lenses(decoder.decode(packet), 2)
        frame = Frame("camera-360", seq, t_ns, t_ns + 1000, lenses, RIG, scene.world_from_rig)
        truth = RecordedTruth(
            seq,
            t_ns,
            true_poses(scene, seq),
            {"chair-1": 0.2 if seq in HIDDEN else 1.0, "stool-1": 1.0},
            frozenset({"chair-1"} if seq >= CHAIR_STARTS else ()),
            scene.world_from_rig,
        )
        avatar = Avatar("maya", "remote", Pose.from_yaw(0.0, (0.0, 0.0, 1.6)))
        events = (Event(t_ns, "ana", "push", "pushes chair 1"),) if seq == CHAIR_STARTS else ()
        yield SessionMessage(SessionInput(frame, packet, (avatar,), events), GroundTruth(truth))


class OffsetTracker:
    """Knows the truth and is wrong by a fixed distance and angle."""

    def __init__(self, scene, offset_m, offset_rad=0.0):
        self._scene, self._offset_m, self._offset_rad = scene, offset_m, offset_rad

    def start(self):
        return 0

    def step(self, state, frame, now_ns):
        tracks = []
        for object_id, pose in true_poses(self._scene, frame.seq).items():
            shown = Pose.from_yaw(
                pose.yaw() + self._offset_rad, pose.translation + np.array([0, self._offset_m, 0])
            )
            hidden = object_id == "chair-1" and frame.seq in HIDDEN
            known = TrackState.OCCLUDED if hidden else TrackState.TRACKED
            tracks.append(
                TrackedObject(
                    object_id, frame.t_ns, shown, np.eye(4) * 1e-4, 1.0, known, 0.9, frame.seq
                )
            )
        stages = MappingProxyType({"detect": 2_000_000, "pose": 5_000_000})
        return state + 1, TrackOutput(tuple(tracks), stages, frame.world_from_rig)


def make_session(
    plan,
    scene,
    *,
    offset_m=0.03,
    offset_rad=0.02,
    inputs=None,
    methods=None,
    truth_detector=None,
):
    info = SessionInfo(
        scene="tiny",
        scene_hash=scene_hash(scene),
        seed=plan.seed,
        scenario=SCENARIO,
        scenario_name="tiny-push",
        mode=str(plan.pace),
        methods=plan.methods,
        versions={"gaussiannexus-studio": "0.1.0"},
        rig=RIG,
        fps=float(FPS),
        changes=() if plan.fork is None else plan.fork.changes,
        fork=None if plan.fork is None else plan.fork.origin,
    )
    exact = plan.pace is Pace.EXACT
    clock = ManualClock() if exact else WallClock()
    return Session(
        plan,
        scene,
        info,
        inputs or (lambda: make_inputs(scene)),
        methods
        or {
            name: OffsetTracker(scene, offset_m * (1 + i), offset_rad)
            for i, name in enumerate(plan.methods)
        },
        duration_ns=FRAMES * 10**9 // FPS,
        clock=clock,
        executor=ExactExecutor(clock) if exact else PacedExecutor(clock),
        truth_detector=truth_detector,
    )


@pytest.fixture(scope="session")
def tiny():
    """The tiny room and what is needed to play in it."""
    scene = make_scene()
    return SimpleNamespace(
        scene=scene,
        frames=FRAMES,
        starts=CHAIR_STARTS,
        hidden=HIDDEN,
        inputs=lambda: make_inputs(scene),
        session=lambda plan, **options: make_session(plan, scene, **options),
        scenario=SCENARIO,
        tracker=lambda offset_m: OffsetTracker(scene, offset_m),
    )


@pytest.fixture
def no_display(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def no_traceback(monkeypatch):
    monkeypatch.delenv("NEXUS_TRACEBACK", raising=False)
    assert "NEXUS_TRACEBACK" not in os.environ


def load_beside(name):
    """A module beside this file: tests are no package."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).parent / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


audit = load_beside("audit")
browser = load_beside("browser")
firefox_browser = load_beside("firefox")


@pytest.fixture(scope="session")
def modules():
    try:
        return web_modules(print)
    except MissingWebFilesError as error:
        pytest.skip(f"three.js and Spark cannot be had here: {error}")


@pytest.fixture(scope="session")
def node_file(modules):
    """A function that gives a file of a package that only tests need, fetched if missing."""

    def path_of(*parts):
        path = WEB.joinpath("node_modules", *parts)
        if not path.is_file():
            try:
                fetch(WEB, for_tests=True)
            except MissingWebFilesError as error:
                pytest.skip(f"{parts[0]} cannot be had here, npm would fetch it: {error}")
        return path

    return path_of


@pytest.fixture(scope="session")
def audited(node_file):
    """A function that gives what axe-core finds in a page."""
    source = node_file("axe-core", "axe.min.js").read_text(encoding="utf-8")
    return lambda page: audit.audited(page, source)


@pytest.fixture(scope="session")
def lab():
    return open_scene("lab")


@pytest.fixture(scope="session")
def chromium(tmp_path_factory):
    """One browser for all tests of a run."""
    if browser.browser_path() is None:
        pytest.skip(
            f"no browser here: none of {', '.join(browser.NAMES)}; "
            "`./nexus test` as root installs chromium on Debian"
        )
    with browser.opened_browser(tmp_path_factory.mktemp("profile")) as page:
        yield page


@pytest.fixture(scope="session")
def firefox(tmp_path_factory):
    """One Firefox for all tests of a run."""
    if (why := firefox_browser.missing()) is not None:
        pytest.skip(why)
    with firefox_browser.opened_firefox(tmp_path_factory.mktemp("firefox")) as page:
        yield page
