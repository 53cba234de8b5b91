"""Why some mutants are found by nothing, in words."""

__all__ = ["EXPLAINED"]

_COPY = ("The counter of the copy differs only outside it; the next start clears it. Until then it "
         "is an address of words that the copy writes over: no pin shows it, but that takes the "
         "whole content of the memory to prove.")
_WHOLE_RUN = ("No promise breaks, and of a wide word z3 did not prove in its time that it never "
              "shows.")
_TAKEN = ("It shows only in a move that waits, or in a state that lasts longer than a clock; in "
          "the machine a move is taken in the clock in which it is offered.")

EXPLAINED: dict[tuple[str, str], str] = {
    **{("coordinates", f"hdl/fresa/motion/coordinates.py:120 (reading): mux {change}"): _COPY
       for change in ("A[0] inverted where bit 1 is 0", "A[0] inverted where bit 4 is 1",
                      "A[1] inverted", "A[3] inverted", "A[4] inverted", "S[0] stuck at 1")},
    **{("controller", f"hdl/fresa/motion/sequencer.py:112 (raising): mux {change}"): _TAKEN
       for change in ("B[0] stuck at 1", "S[0] stuck at 0")},
    ("mill", "hdl/fresa/motion/sequencer.py:112 (raising): mux A[0] stuck at 1"): _TAKEN,
    ("mill", "hdl/fresa/motion/sequencer.py:183 (no name): or A[0] stuck at 1"): _TAKEN,
    **{(whole, f"hdl/fresa/motion/sequencer.py:{place}"): _WHOLE_RUN for whole, place in (
        ("controller", "115 (steps_x): mux B[11] inverted"),
        ("mill", "115 (steps_x): mux B[4] inverted"),
        ("mill", "116 (steps_y): mux B[4] stuck at 1"),
        ("mill", "116 (steps_y): mux B[13] stuck at 1"))},
}
"""By component and mutant, as ``tools.mutate`` writes it."""
