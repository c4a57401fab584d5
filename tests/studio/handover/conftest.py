"""A tiny rehearsal's folder to share, and the page of the built-in lab in a real browser."""

import threading

import numpy as np
import pytest

from devices.session_info import SessionInfo
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.state import Annotation, Avatar, TrackedObject, TrackState
from studio import rehearsal
from studio.console.progress import Progress
from studio.handover.moments import Moments
from studio.handover.viewer_page import write_viewer
from studio.session.plan import SessionPlan
from studio.web.web_files import licences

CHAIR_FROM, CHAIR_TO = (-0.4, 0.3, 0.0), (0.9, -0.6, 0.0)


@pytest.fixture(scope="session")
def rehearsed(tiny, tmp_path_factory):
    """The folder of a rehearsal in the tiny room."""
    folder = tmp_path_factory.mktemp("handover") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rehearsal, "open_session", tiny.session)
        rehearsal.perform(SessionPlan(methods=("own",)), folder, progress=Progress(lambda *_: None))
    return folder


@pytest.fixture
def in_tiny_scene(tiny, monkeypatch):
    """The tiny room is opened, whatever the recording names."""
    from studio.handover import share

    monkeypatch.setattr(share, "recorded_scene", lambda _info: tiny.scene)


def track(object_id, t_ns, pose, state):
    return TrackedObject(object_id, t_ns, pose, np.zeros((4, 4)), 1.0, state, 1.0, 0)


def guest(step):
    """Somebody on site whose hands are tracked, and who goes away."""
    eyes = np.array([1.2, 0.4 + 0.03 * step, 1.6])
    head = look_at(eyes, np.array([0.0, 0.4, 1.5]))
    spread = np.array(
        [
            [0.03 + 0.03 * bone, 0.02 * (2 - finger), 0.0]
            for finger in range(5)
            for bone in range(4 + (finger > 0))
        ]
    )
    hands = tuple(
        np.concatenate([np.zeros((1, 3)), spread * (-1, way, 1)]) + eyes + (-0.4, -0.2 * way, -0.4)
        for way in (1, -1)
    )
    return Avatar("grace", "local", head, hands)


def lab_moments():
    """Two seconds: chair 1 moves from the first to the second; a person points, another
    one goes away after one; a line is drawn."""
    moments = Moments(end_ms=2000, frames=21, moved={"chair-1"})
    for step in range(21):
        t_ns, share = step * 100_000_000, float(np.clip((step - 5) / 10, 0, 1))
        place = (1 - share) * np.array(CHAIR_FROM) + share * np.array(CHAIR_TO)
        state = TrackState.TRACKED if step > 5 else TrackState.STATIC
        moments.add_track(track("chair-1", t_ns, Pose.from_yaw(share, place), state))
        eye = np.array([-1.5, -1.0 + 0.02 * step, 1.6])
        ray = np.array([eye, place]) if step >= 10 else None
        head = look_at(eye, np.array([0.0, 0.5, 1.0]))
        moments.add_person(t_ns, Avatar("remote-user", "remote", head, ray=ray))
        if step < 10:
            moments.add_person(t_ns, guest(step))
        elif step == 10:
            moments.end_person(t_ns, "grace")
    line = np.array([[0.0, 2.0, 1.2], [0.5, 2.0, 1.5], [1.0, 2.0, 1.2]])
    moments.add_line(1_500_000_000, Annotation("line-1", "remote-user", line, (1.0, 0.0, 1.0)))
    moments.events.append((500, "pushes <b>chair-1</b>"))
    return moments


@pytest.fixture(scope="session")
def lab_info(tiny):
    info = tiny.session(SessionPlan(methods=("own",))).info
    assert isinstance(info, SessionInfo)
    return info


@pytest.fixture(scope="session")
def lab_page(lab, lab_info, modules, tmp_path_factory):
    """`viewer.html` of the lab."""
    path = tmp_path_factory.mktemp("page") / "viewer.html"
    write_viewer(
        path,
        scene=lab,
        info=lab_info,
        moments=lab_moments(),
        modules=modules,
        licences=licences(),
        most_bytes=25_000_000,
        cancelled=threading.Event(),
    )
    return path
