import pytest

from studio.app.timeline.recorded.reading import read_index
from studio.session.plan import SessionPlan


@pytest.fixture(scope="session")
def recording(tiny, tmp_path_factory):
    """A recorded session of the tiny room: twelve frames, a chair that moves and is hidden."""
    path = tmp_path_factory.mktemp("recorded") / "recording.mcap"
    tiny.session(SessionPlan(methods=("own",), record_to=path)).run(lambda _output: None)
    return path


@pytest.fixture(scope="session")
def index(recording):
    return read_index(recording)
