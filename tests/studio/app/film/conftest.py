import pytest

from studio.session.plan import SessionPlan


@pytest.fixture(scope="session")
def recording(tiny, tmp_path_factory):
    """A recorded session of the tiny room: twelve frames, a chair that moves and is hidden."""
    path = tmp_path_factory.mktemp("filmed") / "recording.mcap"
    tiny.session(SessionPlan(methods=("own",), record_to=path)).run(lambda _output: None)
    return path
