"""A timing diagram of the documentation: which part of which bench's waveform."""

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
        What there is to be seen.
    signals : str
        Signals and headings, with spaces between.
    start, end : int
        The clocks from and to which it goes.
    radix : tuple of str
        How values are written, such as ``value=hex``.
    """

    bench: str
    shows: str
    signals: str
    start: int
    end: int
    radix: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """Its name in words."""
        return self.bench.replace("-", " ").capitalize().replace("Uart", "UART")
