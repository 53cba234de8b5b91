"""Why some mutants survive, in words."""

from collections.abc import Mapping, Sequence
from functools import cache

from ..machine import Machine
from ..machines import machines

__all__ = ["explained"]

_RESET_STEPS = ("The steps to go are computed anew in every clock and not read at rest: what a "
                "reset leaves there is overwritten before. Of a word of 16 bits z3 does not prove "
                "it in its time.")
_UPSET = ("It shows only in the clock after an upset that leaves the register of the states at an "
          "unused code while there is a way to go; the upsets of mutants leave all other registers "
          "as after power-up, those of tools.prove do not.")
_NO_ANSWER_WAITS = ("It shows only in an answer that waits. Their receiver is ready from the clock "
                    "of the request until there is one, as the contract assumes: none waits.")
_LAST_STEP = ("The direction differs only where the target is one step away, or reached. From rest "
              "such a step leaves the level at 0, where the step requested does not depend on it. "
              "Induction over `level` proves it, which is no state machine.")
_WAY_AT_REST = ("The register of the direction is loaded in every clock: with itself where the "
                "level is not 0; at level 0 it is not used, and the step that leaves it loads it. "
                "Induction over `level` proves it, which is no state machine.")
_SHIFTED_OUT = ("The sample differs only in the first clock after a reset, in which another takes "
                "its place: no bit is decided there. Only induction over the state and `time` "
                "together proves it.")

_GENERAL: Mapping[tuple[str, str], str] = {
    ("sequencer", "eq 8: A[3] stuck at 0"): _UPSET,
    ("controller", "mux 34: B[11] inverted"): _RESET_STEPS,
    ("controller", "mux 34: B[15] inverted"): _RESET_STEPS,
    ("ramp", "gt 2: A[0] inverted where bit 6 is 0"): _LAST_STEP,
    ("ramp", "mux 9: S[0] stuck at 1"): _WAY_AT_REST,
    ("order_ledger", "mux 3: A[2] stuck at 1"): _NO_ANSWER_WAITS,
    ("order_ledger", "mux 3: A[3] inverted where bit 2 is 1"): _NO_ANSWER_WAITS,
    ("uart_receiver", "mux 20: B[1] stuck at 1"): _SHIFTED_OUT,
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
