"""Why some mutants of the mill and of its parts are found by nothing."""

__all__ = ["SURVIVORS"]

_TAKEN = ("It shows only in a move that waits, or in a state that lasts longer than a clock; in "
          "the machine a move is taken in the clock in which it is offered.")
_WHOLE_RUN = ("No property breaks, and of a wide word z3 did not prove in its time that it "
              "never shows.")
_AFTER_RESET = ("It shows in the steps for a clock after reset, in which the sequencer is at rest "
                "and makes them anew. Of the sequencer by itself the same change is proved to be "
                "none.")

SURVIVORS = {
    ("mill", "mux 14: A[0] stuck at 1"): _TAKEN,
    ("mill", "mux 29: B[4] inverted"): _WHOLE_RUN,
    ("mill", "mux 43: B[4] stuck at 1"): _WHOLE_RUN,
    ("mill", "mux 43: B[13] stuck at 1"): _WHOLE_RUN,
    ("mill", "mux 29: B[0] stuck at 1"): _AFTER_RESET,
}
