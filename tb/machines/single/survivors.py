"""Why some mutants of `single` and of its parts are found by nothing."""

__all__ = ["SURVIVORS"]

_READ_AS_DAMAGED = ("The end of a damaged line has a code that no end has. Frames take every end "
                    "for damaged that is neither good nor too long: no pin shows it.")

SURVIVORS = {
    ("single", "lines: mux 3: B[0] stuck at 1"): _READ_AS_DAMAGED,
}
