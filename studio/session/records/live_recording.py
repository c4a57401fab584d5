"""A recording that may fail while the session goes on: a full disk does not end a live session."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from types import TracebackType

from devices.recording import Recorder
from devices.recording_codec import RecordedValue
from devices.session_info import SessionInfo
from devices.streams import StreamClosedError, StreamFullError
from studio.session.pipeline import RecorderThread


class LiveRecording:
    """Records until it is left or writing fails. Use as a context manager.

    Args:
        path: of the recording; `path` + ".part" is written, and kept where writing fails.
        info: how the session is made.

    Raises:
        OSError: the file cannot be made.

    Attributes:
        failure: why nothing is recorded any more, in a sentence; empty while all is well.
    """

    def __init__(self, path: Path, info: SessionInfo) -> None:
        self.failure = ""
        self._recorder = Recorder(path, info)
        self._thread = RecorderThread(self._recorder)
        self._stack = ExitStack()

    @property
    def shed_video(self) -> int:
        """Video packets left out for lack of room."""
        return self._recorder.shed_video

    def write(self, value: RecordedValue) -> None:
        """Record a value, waiting for the disk a moment; after a failure nothing happens."""
        if self.failure:
            return
        try:
            self._thread.write(value)
        except (OSError, ValueError) as error:
            self._fail(error)

    def offer(self, value: RecordedValue) -> None:
        """Record a value without waiting; any thread.

        Raises:
            StreamFullError: the disk is too slow.
            StreamClosedError: recording has stopped.
        """
        if self.failure:
            raise StreamClosedError(self.failure)
        self._thread.offer(value)

    def __enter__(self) -> LiveRecording:
        self._stack.enter_context(self._recorder)
        self._stack.enter_context(self._thread)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        # Given the failure, both leave the unfinished file as it is.
        failed = OSError(self.failure) if self.failure else error
        try:
            self._stack.__exit__(None if failed is None else type(failed), failed, traceback)
        except (OSError, StreamFullError) as late:
            self._fail(late)

    def _fail(self, error: Exception) -> None:
        self.failure = self.failure or str(error)
