"""A session without a port: what it sends, what it hears, and the time."""

from typing import Any

from fresa_host.session import Operation, Session, Waiting


class SessionLine:
    """A session at 10 s."""

    session: Any

    def __init__(self, session: Session) -> None:
        self.session, self.now = session, 10.0

    @property
    def sent(self) -> bytes:
        """What it has sent since this was last read."""
        return b"".join(output.data for output in self.session.take_outputs())

    def begin(self, steps: Waiting) -> Operation:
        """Begin an operation."""
        return self.session.begin(steps, self.now)

    def hear(self, data: bytes) -> None:
        """Let it receive."""
        self.session.receive(data, self.now)

    def tick(self, seconds: float) -> None:
        """Let time pass."""
        self.now += seconds
        self.session.tick(self.now)
