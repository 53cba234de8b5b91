"""Why some mutants of `single` and of its parts are found by nothing."""

__all__ = ["SURVIVORS"]

_READ_AS_DAMAGED = ("The end of a damaged line has a code that no end has. Frames take every end "
                    "for damaged that is neither good nor too long: no pin shows it.")
_OF_NO_POWER = ("The bit is 0 in every power of ten, which is what it is held at. Only a property "
                "of the register that keeps them says so; the contract of frames has none of it.")

SURVIVORS = {
    ("frames", "mux 18: Y[12] stuck at 0"): _OF_NO_POWER,
    ("single", "lines: mux 3: B[0] stuck at 1"): _READ_AS_DAMAGED,
}
