"""Protocol of grabbing objects with the mouse while physics runs."""

from __future__ import annotations

from typing import Protocol

from numpy.typing import ArrayLike


class Grabbing(Protocol):
    """Grab, drag, release: a view calls these with points of the world, on the main thread.

    A drag is `grab`, any number of `drag`, `release`; none of them waits for physics. While objects
    move, the bench shows them; when they have come to rest the document gets one step of undo.
    """

    @property
    def grabbed(self) -> str:
        """Id of what is held now, or ""."""
        ...

    def grab(self, object_id: str, point_in_world: ArrayLike) -> bool:
        """Grip an object or primitive where it was clicked (3,), world metres.

        Returns:
            Whether it is gripped; if not, the log says why, and `drag` and `release` do nothing.
        """
        ...

    def drag(self, target_in_world: ArrayLike, *, turn_rad: float = 0.0) -> None:
        """Pull the gripped point to another (3,); the newest target counts.

        Args:
            target_in_world: metres.
            turn_rad: about up, from how it was turned when gripped: of the wheel.
        """
        ...

    def release(self) -> None:
        """Let go: what is moving flies on."""
        ...
