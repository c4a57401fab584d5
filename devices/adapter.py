"""Adapter, as the session sees every source of data: real, simulated or recorded."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from devices.clock import Clock
from devices.streams import StreamClosedError
from scenes.workers.task import Task


class Timed(Protocol):
    """A message with a capture time."""

    @property
    def t_ns(self) -> int:
        """Capture time on the session clock."""
        ...


M = TypeVar("M", bound=Timed)
M_co = TypeVar("M_co", bound=Timed, covariant=True)
M_contra = TypeVar("M_contra", bound=Timed, contravariant=True)


class Sink(Protocol[M_contra]):
    """Receiver of an adapter's messages, from its own thread: a `Slot` or a `BoundedQueue`."""

    def put(self, value: M_contra) -> None:
        """Take one message."""
        ...

    def close(self) -> None:
        """No more will come."""
        ...


@dataclass(frozen=True, slots=True)
class DeviceStatus:
    """How a device is doing.

    Attributes:
        name: shown to people.
        running: between start and the end of its data.
        emitted: messages so far.
        error: what stopped it, in one line, or empty.
    """

    name: str
    running: bool
    emitted: int
    error: str = ""


class Device(Protocol[M_co]):
    """A source of messages."""

    def start(self, sink: Sink[M_co], clock: Clock) -> None:
        """Begin to emit messages into `sink`, each at its time on `clock`; close it at the end.

        Raises:
            ValueError: it was started before.
        """
        ...

    def stop(self) -> None:
        """Stop and wait until nothing more is emitted. Harmless when stopped already."""
        ...

    def status(self) -> DeviceStatus:
        """How it is doing now."""
        ...


class IteratorDevice(Generic[M]):
    """An adapter around messages that can be iterated: a recording, a simulation.

    Args:
        name: shown to people.
        messages: called once on the device's thread; yields messages in order of `t_ns`.
    """

    def __init__(self, name: str, messages: Callable[[], Iterator[M]]) -> None:
        self._name = name
        self._messages = messages
        self._target: tuple[Sink[M], Clock] | None = None
        self._task = Task(name, self._emit)
        self._emitted = 0
        self._failure: Exception | None = None

    @property
    def failure(self) -> Exception | None:
        """Error that ended it early, for the session to raise on its own thread."""
        return self._failure

    def start(self, sink: Sink[M], clock: Clock) -> None:
        """See `Device.start`."""
        if self._target is not None:
            raise ValueError(f"{self._name}: started before; make a new one to start again")
        self._target = sink, clock
        self._task.start()

    def stop(self) -> None:
        """See `Device.stop`."""
        self._task.cancel()
        self._task.join()

    def status(self) -> DeviceStatus:
        """See `Device.status`."""
        return DeviceStatus(
            self._name, self._task.is_running, self._emitted, str(self._failure or "")
        )

    def _emit(self, task: Task[None]) -> None:
        assert self._target is not None
        sink, clock = self._target
        try:
            for message in self._messages():
                clock.sleep_until(message.t_ns)
                if task.is_cancelled:
                    break
                sink.put(message)
                self._emitted += 1
        except StreamClosedError:
            pass  # the reader went away first: an ordinary end
        except Exception as error:  # noqa: BLE001 - handed to the session, which raises it
            self._failure = error
        finally:
            sink.close()
