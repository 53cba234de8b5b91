"""Programs of others that do the work, and what they say when they do not."""

__all__ = ["ProgramError", "last_words"]


class ProgramError(RuntimeError):
    """A program cannot start, or fails; the text says which, and why, in a line or a few."""


def last_words(output: str) -> str:
    """Return the line of a program's output that says why it failed.

    It is the last that begins with ``ERROR``, as Yosys writes; or else the last, which of a
    traceback of Python is its error.
    """
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    errors = [line for line in lines if line.startswith("ERROR")]
    return (errors or lines or ["it says nothing"])[-1]
