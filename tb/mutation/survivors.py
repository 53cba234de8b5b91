"""Why some mutants are found by nothing, in words."""

__all__ = ["EXPLAINED"]

_COPY = ("The counter of the copy differs only outside it; the next start clears it. Until then it "
         "is an address of words that the copy writes over: no pin shows it, but that takes the "
         "whole content of the memory to prove.")
_WHOLE_RUN = ("No promise breaks, and of a wide word z3 did not prove in its time that it never "
              "shows.")
_TAKEN = ("It shows only in a move that waits, or in a state that lasts longer than a clock; in "
          "the machine a move is taken in the clock in which it is offered.")
_TOGETHER = ("It shows only where two distances of 0 are gone together; `together-moves` of the "
             "sequencer says that there are none.")
_UPSET = ("It shows only in the clock after an upset that leaves the register of the states at an "
          "unused code while there is a way to go; the upsets of mutants leave all other registers "
          "as after power-up, those of tools.prove do not.")

_AFTER_RESET = ("It shows in the steps for a clock after reset, in which the sequencer is at rest "
                "and makes them anew. Of the sequencer by itself the same change is proved to be "
                "none.")

EXPLAINED: dict[tuple[str, str], str] = {
    **{("coordinates", f"hdl/fresa/motion/coordinates.py:120 (reading): mux {change}"): _COPY
       for change in ("A[0] inverted where bit 1 is 0", "A[0] inverted where bit 4 is 1",
                      "A[1] inverted", "A[3] inverted", "A[4] inverted", "S[0] stuck at 1")},
    **{("coordinates", f"no line (no name): reduce_bool {port} stuck at 1"): _COPY
       for port in ("A[1]", "Y[0]")},
    **{("controller", f"hdl/fresa/motion/sequencer.py:112 (raising): mux {change}"): _TAKEN
       for change in ("B[0] stuck at 1", "S[0] stuck at 0")},
    **{("controller", f"no line (no name): {change}"): _TAKEN
       for change in ("ne A[1] inverted", "reduce_and A[4] stuck at 1")},
    ("mill", "hdl/fresa/motion/sequencer.py:112 (raising): mux A[0] stuck at 1"): _TAKEN,
    **{("mill", f"no line (no name): ne {change}"): _TAKEN
       for change in ("A[1] stuck at 1", "B[0] stuck at 0")},
    ("mill", "hdl/fresa/motion/sequencer.py:183 (no name): or A[0] stuck at 1"): _TAKEN,
    ("mill", "hdl/fresa/motion/order_control.py:75 (moves__payload): pmux B[1] inverted where bit "
             "3 is 0"): _TOGETHER,
    ("sequencer", "no line (no name): eq A[3] stuck at 0"): _UPSET,
    **{(whole, f"hdl/fresa/motion/sequencer.py:{place}"): _WHOLE_RUN for whole, place in (
        ("controller", "115 (steps_x): mux B[11] inverted"),
        ("mill", "115 (steps_x): mux B[4] inverted"),
        ("mill", "116 (steps_y): mux B[4] stuck at 1"),
        ("mill", "116 (steps_y): mux B[13] stuck at 1"))},
    ("mill", "hdl/fresa/motion/sequencer.py:115 (steps_x): mux B[0] stuck at 1"): _AFTER_RESET,
}
"""By component and mutant, as ``tools.mutate`` writes it."""
