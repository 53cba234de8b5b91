"""Bytes to lines of text, whatever comes."""

__all__ = ["LONGEST", "LineSplitter"]

#: Longest line that any machine sends, and more. Longer ones are noise.
LONGEST = 256


class LineSplitter:
    """Gathers bytes into lines that end with CR, LF or both.

    Memory is bounded: a line of more than `LONGEST` bytes is left out. So are empty lines.
    """

    def __init__(self) -> None:
        self._begun = bytearray()
        self._too_long = False

    def feed(self, data: bytes) -> list[str]:
        """Take bytes; give the lines that they complete. What is not ASCII becomes U+FFFD."""
        *ended, rest = data.replace(b"\r", b"\n").split(b"\n")
        lines = []
        for part in ended:
            self._add(part)
            if self._begun and not self._too_long:
                lines.append(self._begun.decode("ascii", "replace"))
            self.clear()
        self._add(rest)
        return lines

    def clear(self) -> None:
        """Forget the line that has begun."""
        self._begun.clear()
        self._too_long = False

    def _add(self, part: bytes) -> None:
        self._too_long |= len(self._begun) + len(part) > LONGEST
        if not self._too_long:
            self._begun += part
