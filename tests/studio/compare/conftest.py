"""Two rehearsals in the tiny room: A is off by 3 cm, B by more; B says that it is a fork of A."""

import hashlib
from dataclasses import replace

import pytest

from devices.session_info import ForkOrigin, ScenarioChange
from studio import rehearsal
from studio.console.progress import Progress
from studio.session.plan import SessionPlan


def perform(tiny, folder, patch, *, change=lambda info: info, **options):
    def open_session(plan, **given):
        session = tiny.session(plan, **options, **given)
        session.info = change(session.info)
        return session

    patch.setattr(rehearsal, "open_session", open_session)
    rehearsal.perform(SessionPlan(methods=("own",)), folder, progress=Progress(lambda *_: None))
    return folder


@pytest.fixture(scope="session")
def two_runs(tiny, tmp_path_factory):
    """Folders A and B."""
    folder = tmp_path_factory.mktemp("runs")
    with pytest.MonkeyPatch.context() as patch:
        a = perform(tiny, folder / "a", patch)
        digest = hashlib.sha256((a / "recording.mcap").read_bytes()).hexdigest()

        other = tiny.scenario + "[faults]\ndrop_share = 0.1\n"

        def forked(info):
            return replace(
                info,
                changes=(ScenarioChange(500_000_000, other, "other"),),
                fork=ForkOrigin("recording.mcap", digest, 500_000_000),
            )

        return a, perform(tiny, folder / "b", patch, change=forked, offset_m=0.05)


@pytest.fixture
def in_tiny_scene(tiny, monkeypatch):
    """The tiny room is opened, whatever the recordings name."""
    from studio.compare import comparison

    monkeypatch.setattr(comparison, "recorded_scene", lambda _info: tiny.scene)


@pytest.fixture
def compared(two_runs, in_tiny_scene):
    from studio.compare.comparison import read_comparison

    return read_comparison(*two_runs, tolerance=0.1)
