"""What fuzzing uses of a serial line."""

from ..uart import (
    FRAME,
    BitTimingError,
    DecodedByte,
    Levels,
    Text,
    decode,
    decode_output,
    high,
    levels,
)

__all__ = ["CUT", "FRAME", "BitTimingError", "DecodedByte", "Levels", "Text", "decode",
           "decode_output", "high", "levels"]

#: A clock that is never reached.
CUT = 1 << 60
