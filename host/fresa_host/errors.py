"""What can go wrong with a machine at the other end of a line."""

__all__ = ["JobStopped", "LimitReached", "LineLost", "MachineError", "Refused", "Stalled",
           "TimedOut", "WasReset"]


class MachineError(Exception):
    """Something is wrong with the machine or the way to it; the text says what in one line."""


class LineLost(MachineError):
    """The port cannot be opened, or is gone: unplugged, for instance."""


class TimedOut(MachineError, TimeoutError):
    """The machine did not answer, or did not arrive, in the time that it was given."""


class Stalled(MachineError):
    """A motor makes no step on its way to where it was sent: it has no power, say."""


class WasReset(MachineError):
    """The machine was switched off and on, or reset: it may count its position from 0 again."""

    def __init__(self, text: str = "the machine was reset: it is at position 0 again, wherever "
                 "that is") -> None:
        super().__init__(text)


class JobStopped(MachineError):
    """A job was stopped. One of the mill can be gone on with."""


class Refused(MachineError):
    """The machine did not do what was requested, and changed nothing.

    Attributes
    ----------
    reason : str
        Why, in the machine's own word, such as ``RANGE``.
    """

    def __init__(self, reason: str, meaning: str) -> None:
        super().__init__(f"the machine refused: {meaning} ({reason})")
        self.reason = reason


class LimitReached(MachineError):
    """A limit switch ended a movement. The way back is free.

    Attributes
    ----------
    axes : frozenset of str
        The axes, of ``x``, ``y`` and ``z``.
    """

    def __init__(self, axes: frozenset[str]) -> None:
        super().__init__(f"a limit switch stopped {', '.join(sorted(axes))}: move away from it")
        self.axes = axes
