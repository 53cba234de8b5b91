"""A timing diagram of the documentation: a part of the waveform of a bench."""

from dataclasses import dataclass

__all__ = ["Diagram"]


@dataclass(frozen=True)
class Diagram:
    """A part of the waveform of a bench.

    Attributes
    ----------
    bench : str
        Name of the bench, and of the diagram.
    shows : str
        Caption of the diagram.
    signals : str
        Signals and headings, with spaces between.
    start, end : int
        First and last clock.
    radix : tuple of str
        Radixes of values, such as ``value=hex``.
    """

    bench: str
    shows: str
    signals: str
    start: int
    end: int
    radix: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """Its title."""
        return self.bench.replace("-", " ").capitalize().replace("Uart", "UART")
