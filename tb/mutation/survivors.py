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
_OTHER_PLACE = ("The place differs only while no text is sent, where nobody looks at it; the "
                "number that is taken next loads it. Induction over `busy` proves it, which is no "
                "state machine.")
_LINE_AT_REST = ("The time differs only in IDLE while the line is high, where it starts nothing; "
                 "the start bit loads it, and two looks at that bit push out whatever was looked "
                 "at before. Induction over state and time together proves it.")
_NO_SUCH_TIME = ("It shows only in IDLE at a time of -1, which no state hands on to IDLE, and IDLE "
                 "does not count. Induction with that as an invariant proves it.")
_LOOK_MORE = ("There is one look more, and the two behind it push it out before the bit is "
              "decided. Induction over state and time together proves it.")
_NO_ANSWER_WAITS = ("It shows only in an answer that waits. Who takes answers is ready from the "
                    "clock of the request until there is one, as the contract assumes: none waits.")
_ALL_SAID = ("It is in the answer to a motor that there is not, which is ARGUMENT: the "
             "bit is 1 in it anyway.")
_REFUSED = ("The place differs only in a line that is refused, of which nothing more is read; the "
            "next line begins at 0. In a good line the contract says it, and is proved of the "
            "mutant too.")
_ZEROS = ("It leaves zeros inside a number unsaid, and of all reports none on this bench has any. "
          "The contract of the writer of numbers finds it in the writer by itself.")
_NO_TENS = ("It counts tens as elevens, and no number that this bench says has any. The contract "
            "of the writer of numbers finds it in the writer by itself.")
_LEAVES_FAULT = ("It lets an interpreter of frames that is upset leave FAULT. The contract of "
                 "frames finds it in the interpreter by itself.")
_READ_AS_DAMAGED = ("The end of a damaged line has a code that no end has. Frames take every end "
                    "for damaged that is neither good nor too long: no pin shows it.")

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
    **{("text", f"hdl/fresa/protocol/text.py:67 (place): {change}"): _OTHER_PLACE
       for change in ("mux B[0] inverted", "pmux A[1] stuck at 0", "pmux A[3] inverted",
                      "pmux A[3] stuck at 0", "pmux A[3] stuck at 1", "pmux S[2] stuck at 1")},
    **{("uart_receiver", f"hdl/fresa/protocol/receiver.py:100 (time): mux {change}"): _LINE_AT_REST
       for change in ("Y[1] inverted where bit 0 is 1", "Y[2] inverted where bit 1 is 1",
                      "Y[3] inverted where bit 0 is 1")},
    ("uart_receiver", "hdl/fresa/protocol/receiver.py:100 (time): pmux B[9] inverted where bit 19 "
                      "is 0"): _NO_SUCH_TIME,
    ("uart_receiver", "hdl/fresa/protocol/receiver.py:107 (look): eq A[1] stuck at 1"): _LOOK_MORE,
    ("positioner_commands", "hdl/fresa/protocol/positioner.py:138 (orders__payload): mux A[2] "
                            "stuck at 1"): _ALL_SAID,
    ("positioner_commands", "no line (no name): reduce_and A[1] stuck at 1"): _REFUSED,
    ("reporter", "no line (no name): reduce_and A[1] stuck at 0"): _ZEROS,
    ("single", "hdl/fresa/protocol/line.py:146 (lines.$signature__data): mux B[0] stuck at 1"):
        _READ_AS_DAMAGED,
    ("single", "hdl/fresa/protocol/decimal_writer.py:95 (commands.writer.after): pmux B[42] stuck "
               "at 1"): _NO_TENS,
    ("single", "no line (no name): reduce_bool A[3] stuck at 1"): _LEAVES_FAULT,
    **{("order_ledger", f"hdl/fresa/motion/order_ledger.py:136 (outcome): mux {change}"):
       _NO_ANSWER_WAITS for change in ("A[1] stuck at 1", "A[3] inverted where bit 2 is 1")},
}
"""By component and mutant, as ``tools.mutate`` writes it."""
