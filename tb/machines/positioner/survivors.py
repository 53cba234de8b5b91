"""Why some mutants of `positioner` and of its parts are found by nothing."""

__all__ = ["SURVIVORS"]

_ALL_SAID = ("It is in the answer to a motor that there is not, which is ARGUMENT: the "
             "bit is 1 in it anyway.")
_ZEROS = ("It leaves zeros inside a number unsaid, and of all reports none on this bench has any. "
          "The contract of the writer of numbers finds it in the writer by itself.")

SURVIVORS = {
    ("positioner_commands", "mux 71: A[2] stuck at 1"): _ALL_SAID,
    ("reporter", "reduce_and 8: A[1] stuck at 0"): _ZEROS,
}
