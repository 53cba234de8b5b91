"""Why some mutants are found by nothing, in words."""

from collections.abc import Mapping, Sequence
from functools import cache

from ..machine import Machine
from ..machines import machines

__all__ = ["explained"]

_COPY = ("The counter of the copy differs only outside it; the next start clears it. Until then it "
         "is an address of words that the copy writes over: no pin shows it, but that takes the "
         "whole content of the memory to prove.")
_WHOLE_RUN = ("No property breaks, and of a wide word z3 did not prove in its time that it "
              "never shows.")
_TAKEN = ("It shows only in a move that waits, or in a state that lasts longer than a clock; in "
          "the machine a move is taken in the clock in which it is offered.")
_UPSET = ("It shows only in the clock after an upset that leaves the register of the states at an "
          "unused code while there is a way to go; the upsets of mutants leave all other registers "
          "as after power-up, those of tools.prove do not.")
_OTHER_PLACE = ("The place differs only while no text is sent, where nobody looks at it; the "
                "number that is taken next loads it. Induction over `busy` proves it, which is no "
                "state machine.")
_NO_ANSWER_WAITS = ("It shows only in an answer that waits. Who takes answers is ready from the "
                    "clock of the request until there is one, as the contract assumes: none waits.")

_GENERAL: Mapping[tuple[str, str], str] = {
    ("coordinates", "mux 11: A[0] inverted where bit 1 is 0"): _COPY,
    ("coordinates", "mux 11: A[0] inverted where bit 4 is 1"): _COPY,
    ("coordinates", "mux 11: A[1] inverted"): _COPY,
    ("coordinates", "mux 11: A[3] inverted"): _COPY,
    ("coordinates", "mux 11: A[4] inverted"): _COPY,
    ("coordinates", "mux 11: S[0] stuck at 1"): _COPY,
    ("coordinates", "reduce_bool 2: A[1] stuck at 1"): _COPY,
    ("coordinates", "reduce_bool 2: Y[0] stuck at 1"): _COPY,
    ("controller", "mux 22: B[0] stuck at 1"): _TAKEN,
    ("controller", "mux 22: S[0] stuck at 0"): _TAKEN,
    ("sequencer", "eq 8: A[3] stuck at 0"): _UPSET,
    ("controller", "mux 43: B[11] inverted"): _WHOLE_RUN,
    ("text", "mux 3: B[0] inverted"): _OTHER_PLACE,
    ("text", "pmux 1: A[1] stuck at 0"): _OTHER_PLACE,
    ("text", "pmux 1: A[3] inverted"): _OTHER_PLACE,
    ("text", "pmux 1: A[3] stuck at 0"): _OTHER_PLACE,
    ("text", "pmux 1: A[3] stuck at 1"): _OTHER_PLACE,
    ("text", "pmux 1: S[2] stuck at 1"): _OTHER_PLACE,
    ("order_ledger", "mux 3: A[3] inverted where bit 2 is 1"): _NO_ANSWER_WAITS,
}


def explained() -> dict[tuple[str, str], str]:
    """Return the sentences by component and mutant, as ``tools.mutate`` writes it."""
    return _explained(tuple(machines().values()))


@cache
def _explained(known: Sequence[Machine]) -> dict[tuple[str, str], str]:
    found = dict(_GENERAL)
    for machine in known:
        found |= machine.survivors() if machine.survivors else {}
    return found
