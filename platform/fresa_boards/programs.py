"""Programs of others that do the work, and what they say when they do not."""

__all__ = ["ProgramError", "last_words"]


class ProgramError(RuntimeError):
    """A program cannot start, or fails; the text says which, and why, in a line or a few."""


def last_words(output: str, lines: int = 1) -> str:
    """Return what of a program's output says why it failed.

    It is the last line that begins with ``ERROR``, as Yosys writes; or else the last lines, up to
    so many, of which a traceback of Python has one: its error.
    """
    said = [line.strip() for line in output.splitlines() if line.strip()]
    errors = [line for line in said if line.startswith("ERROR")]
    if "Traceback (most recent call last):" in said:
        lines = 1
    return "\n".join(errors[-1:] or said[-lines:]) or "it says nothing"
