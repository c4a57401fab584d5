import pytest

from studio.session.plan import SessionPlan


@pytest.fixture(scope="session")
def looks_recording(tiny, tmp_path_factory):
    """A recorded session of a second: a chair that moves and is hidden, a stool at rest."""
    path = tmp_path_factory.mktemp("looks") / "recording.mcap"
    tiny.session(SessionPlan(methods=("own",), record_to=path)).run(lambda _output: None)
    return path
