"""What becomes of a mutant: who kills it, or a proof that it is none."""

import os
import random
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from .formula import NO, YES, Unrolled
from .netlist import TRUE, Assertion, MutationError, Netlist
from .parallel import ParallelSimulation

__all__ = ["Judge", "Verdict", "by_chance"]

#: Most clocks of an induction, as ``tools.prove`` has it.
LONGEST = 4
#: Clocks in which an upset is looked at.
UPSET = 6


@dataclass
class Verdict:
    """What became of a mutant.

    Attributes
    ----------
    contract : str
        ``broken``: inputs from power-up, or an upset, lead to a property that is not kept.
        ``unproved``: the contract can no longer be proved. Empty: it holds.
    violated : str
        A property that is not kept, or that is in the way of the proof.
    bench : int or None
        Clock in which a bench found it.
    equivalent : bool
        It was proved that no pin ever shows it.
    seconds : float
        Time that this took.
    """

    contract: str = ""
    violated: str = ""
    bench: int | None = None
    equivalent: bool = False
    seconds: float = 0.0

    @property
    def killed(self) -> bool:
        """Return whether anything found it."""
        return bool(self.contract) or self.bench is not None


def by_chance(netlist: Netlist, mutants: Iterable[int], seed: int, clocks: int,
              stimulus: Sequence[Sequence[int]] = (), *,
              witnesses: dict[str, tuple[int, int]] | None = None
              ) -> tuple[dict[int, int], set[int]]:
    """Look for properties that mutants break, with a stimulus and then with random inputs.

    What shows at the pins is noted too: such a mutant is surely not equivalent.

    Parameters
    ----------
    netlist : Netlist
        All of it.
    mutants : iterable of int
        Which.
    seed : int
        Of the chance.
    clocks : int
        How many of chance.
    stimulus : sequence of sequence of int
        What comes first: levels of the inputs, bit by bit, a row a clock.
    witnesses : dict, optional
        Gets of each property that a mutant breaks one that does, and the clock in which it does,
        from power-up or the upset. Until each has one, those that were found go on.

    Returns
    -------
    found : dict of int to int
        The clock of the run in which each of those found broke a property.
    shown : set of int
        Those that showed at a pin, of the others.
    """
    rng = random.Random(seed)
    found: dict[int, int] = {}
    left = sorted(mutants)
    always = netlist.assertions
    upset = [each for each in always if each.upset]
    if not always:
        return found, set()
    outputs = [net for bits in netlist.outputs.values() for net in bits]
    offered, shown = _offered(netlist), set()
    episodes: list = [(always, (), stimulus, len(stimulus))]
    episodes += [(always, (), None, 250) for _ in range(max(1, clocks // 250))]
    if upset:
        episodes += [(upset, (flops, code), None, 12)
                     for flops in netlist.upsets for code in range(1 << len(flops))]
    for asserted, start, rows, length in episodes:
        if not left or (witnesses is not None and len(witnesses) == len(always)):
            break
        kept = [each.kept for each in asserted]
        simulation = ParallelSimulation(netlist, left, [*kept, *outputs, *netlist.assumed])
        pins = slice(len(kept), len(kept) + len(outputs))
        if start:
            for place, flop in enumerate(start[0]):
                simulation.state[flop] = simulation.every if start[1] >> place & 1 else 0
        chance = _Chance(netlist, rng, simulation.every)
        alive, visible = simulation.every, 0
        for clock in range(length):
            if rows is not None:
                inputs = [simulation.every if bit else 0 for bit in rows[clock]]
                state, seen = simulation.look(inputs)
            else:
                state, seen = chance.look(simulation, pins.stop)
            for used in seen[pins.stop:]:
                alive &= used
            if not alive & 1:  # not even the component as it is may be treated like this
                break
            broken = 0
            for each, held in zip(asserted, seen[:len(kept)], strict=True):
                if wrong := alive & ~held:
                    broken |= wrong
                    if witnesses is not None and each.name not in witnesses and not wrong & 1:
                        lowest = (wrong & -wrong).bit_length() - 1
                        witnesses[each.name] = (simulation.mutants[lowest - 1], clock)
            if broken & 1:
                raise MutationError("the component as it is breaks its contract")
            if broken:
                if witnesses is None:
                    alive &= ~broken
                for place, number in enumerate(simulation.mutants, start=1):
                    if broken >> place & 1:
                        found.setdefault(number, clock)
            levels = dict(zip(outputs, seen[pins], strict=True)) if not start else {}
            for net, level in levels.items():
                if net not in offered or levels[offered[net]] & 1:
                    visible |= alive & (level ^ (simulation.every if level & 1 else 0))
            simulation.state = state
        shown |= {number for place, number in enumerate(simulation.mutants, start=1)
                  if visible >> place & 1}
        if witnesses is None:
            left = [number for number in left if number not in found]
    return found, shown - set(found)


def _offered(netlist: Netlist) -> dict[int, int]:
    """Return by each bit of a payload the net that says that it is offered.

    What a stream shows while it offers nothing is seen by nobody.
    """
    outputs = netlist.outputs
    others = {net for name, bits in outputs.items() if not name.endswith("payload")
              for net in bits}
    return {net: outputs[valid][0] for name, bits in outputs.items()
            if (valid := name.removesuffix("payload") + "valid") in outputs
            and name.endswith("payload") for net in bits if net not in others}


class _Chance:
    """Inputs by chance, such as the component is meant to get."""

    def __init__(self, netlist: Netlist, rng: random.Random, every: int) -> None:
        self._rng, self._every = rng, every
        self._groups: list[list[int]] = []
        place = 0
        for bits in netlist.inputs.values():
            self._groups.append(list(range(place, place + len(bits))))
            place += len(bits)
        self._levels = [0] * place
        # Some inputs change all the time and others seldom; reset is rare.
        self._rates = [rng.choice([1.0, 0.5, 0.1, 0.02]) for _ in self._groups]
        self._ones = [rng.choice([0.5, 0.5, 0.1, 0.9]) for _ in self._groups]
        self._rates[0], self._ones[0] = 1.0, rng.choice([0.0, 0.01, 0.1])

    def look(self, simulation: ParallelSimulation, assumed: int) -> tuple[list[int], list[int]]:
        """Choose inputs; return what :meth:`ParallelSimulation.look` does."""
        levels, result = self._levels, None
        for attempt in range(6):
            levels = list(self._levels)
            for bits, rate, ones in zip(self._groups, self._rates, self._ones, strict=True):
                # Ever fewer changes: what is assumed of the inputs mostly forbids some.
                if self._rng.random() < rate / (1 + attempt):
                    few = len(bits) > 4 and self._rng.random() < 0.5
                    for place, bit in enumerate(bits):
                        one = self._rng.random() < ones and not (few and place > 3)
                        levels[bit] = self._every if one else 0
            result = simulation.look(levels)
            if all(used & 1 for used in result[1][assumed:]):
                break
        self._levels = levels
        return result or simulation.look(levels)


def _processor_seconds() -> float:
    """Return the time of processors that this process has taken, and its solvers."""
    return sum(os.times()[:4])


class Judge:
    """Decides about mutants by formulas.

    Parameters
    ----------
    netlist : Netlist
        All of it.
    seconds : float
        Time of a processor for one question.
    enough : mapping of int to int, optional
        Clocks of induction that prove the properties (0), and those about upsets (1), of the
        component as it is. :meth:`proves` finds them.
    """

    def __init__(self, netlist: Netlist, seconds: float = 10,
                 enough: Mapping[int, int] | None = None) -> None:
        self.netlist, self._seconds = netlist, seconds
        self._always = list(netlist.assertions)
        self._upset = [each for each in netlist.assertions if each.upset]
        self._unrolled: dict[tuple[str, int], Unrolled] = {}
        self.enough = dict(enough or {})

    def _from(self, begin: str, clocks: int) -> Unrolled:
        key = (begin, clocks)
        if key not in self._unrolled:
            self._unrolled[key] = Unrolled(self.netlist, clocks, begin)
        unrolled = self._unrolled[key]
        unrolled.formulas.forget(unrolled.marks)
        return unrolled

    def proves(self) -> bool:
        """Prove the contract of the component as it is: equivalence relies on it."""
        for begin, properties in (("power-up", self._always), ("upset", self._upset)):
            u = self._from(begin, LONGEST)
            if self._breaks(u, [{}] * LONGEST, properties, every=True):
                return False
        return self.unproved(None) == ""

    def verdict(self, number: int, bench: int | None, *, shown: bool = False) -> Verdict:
        """Return what becomes of a mutant.

        Parameters
        ----------
        number : int
            The mutant.
        bench : int or None
            When a bench found it, if one did.
        shown : bool
            It has been seen at a pin, so that it is not equivalent.
        """
        began = time.monotonic()
        verdict = Verdict(bench=bench)
        unproved = self.unproved(number)
        if (bench is None or not unproved) and (violated := self.broken(number, LONGEST)):
            verdict.contract, verdict.violated = "broken", violated
        elif bench is None and not shown and self.equivalent(number):
            verdict.equivalent = True
        elif unproved:
            verdict.contract, verdict.violated = "unproved", unproved
        verdict.seconds = round(time.monotonic() - began, 3)
        return verdict

    def broken(self, number: int, clocks: int) -> str:
        """Look so many clocks for inputs that break a property; give its name, or nothing."""
        worlds = [("power-up", clocks, self._always)]
        if self._upset:
            worlds.append(("upset", min(clocks, UPSET), self._upset))
        for begin, length, properties in worlds:
            u = self._from(begin, length)
            if name := self._breaks(u, u.mutant(number, length), properties):
                return name
        return ""

    def _breaks(self, u: Unrolled, changed: Sequence[Mapping[int, int]], properties: Sequence, *,
                every: bool = False) -> str:
        """Look for a property that breaks in some clocks; with `every`, unchanged ones too."""
        f = u.formulas
        used, goal = YES, NO
        goals = []
        for clock in range(len(changed)):
            for net in self.netlist.assumed:
                used = f.both(used, u.at(clock, net, changed))
            for each in properties:
                if every or each.kept in changed[clock] or used != YES:
                    item = f.both(used, u.at(clock, each.kept, changed) ^ 1)
                    if item != NO:
                        goal = f.either(goal, item)
                        goals.append((each.name, item))
        values = f.solve(goal, [item for _, item in goals], seconds=self._seconds)
        if values is None and every:
            return "time is up"
        return next((name for name, item in goals if values and values[item]), "")

    def unproved(self, number: int | None) -> str | None:
        """Name a property that induction no longer proves; empty if all are proved.

        The number None is the component as it is. None comes of it if time was up.
        """
        for world, properties in enumerate([self._always, self._upset]):
            if not properties:
                continue
            name: str | None = ""
            # What fewer clocks prove more prove too. So begin with as many as it takes for the
            # component as it is, and let only the most say no.
            likely = self.enough[world] if world in self.enough else None
            for clocks in sorted({likely, LONGEST}) if likely else range(1, LONGEST + 1):
                u = self._from("anywhere", clocks + 1)
                changed = [{}] * (clocks + 1) if number is None else u.mutant(number, clocks + 1)
                name = self._step(u, changed, properties)
                if not name:
                    if number is None and name is not None:
                        self.enough[world] = clocks
                    break
            if name != "":
                return name
        return ""

    def _step(self, u: Unrolled, changed: Sequence[Mapping[int, int]], properties: Sequence
              ) -> str | None:
        f, last = u.formulas, len(changed) - 1
        known = f.all_of(u.at(clock, each.kept, changed)
                         for clock in range(last) for each in properties)
        for clock in range(last + 1):
            for net in self.netlist.assumed:
                known = f.both(known, u.at(clock, net, changed))
        goals = [(each.name, u.at(last, each.kept, changed) ^ 1) for each in properties]
        goal = f.both(known, f.any_of(item for _, item in goals))
        values = f.solve(goal, [item for _, item in goals], seconds=3 * self._seconds)
        if values is None:
            return None
        return next((name for name, item in goals if values and values[item]), "")

    def equivalent(self, number: int) -> bool:
        """Prove that from power-up no pin ever shows a mutant, and no upset lets it show soon."""
        return self._equal_for_ever(number, self._always) and (
            not self._upset or self._equal_for_ever(number, self._upset)
            or self._equal_after_upsets(number))

    def _equal_for_ever(self, number: int, properties: Sequence[Assertion]) -> bool:
        """Find by induction which flip-flops are as in the original; then see the pins.

        Some always are. Others, such as the goal of a move, are so only in those states of a state
        machine in which they matter. The properties are proved of the component as it is.
        """
        u = self._from("anywhere", 2)
        f, netlist = u.formulas, self.netlist
        known = f.all_of([*(u.at(clock, each.kept) for clock in range(2)
                            for each in properties),
                          *(u.at(clock, net) for clock in range(2) for net in netlist.assumed)])
        outputs = [net for bits in netlist.outputs.values() for net in bits]
        offered, states = _offered(self.netlist), self._states(u)
        other: dict[int, int] = {}
        same_in: dict[int, set[int]] = {}
        until = _processor_seconds() + self._seconds / 2
        while _processor_seconds() < until:
            begin = {q: f.choose(free, u.at(0, q),
                                 f.any_of(states[state][0] for state in sorted(same_in[q])))
                     for q, free in other.items()}
            now, = u.mutant(number, 1, begin)
            # Where it would differ: a flip-flop at all, or in one state, or a pin.
            differ: dict[tuple[int, int | None], int] = {}
            for flop in netlist.flops:
                if flop.d not in now:
                    continue
                changed = f.differ(u.at(0, flop.d), now[flop.d])
                if flop.q not in other:
                    differ[flop.q, None] = changed
                else:
                    for state in same_in[flop.q]:
                        differ[flop.q, state] = f.both(changed, states[state][1])
            shows = [f.both(f.differ(u.at(0, net), now[net]), u.at(0, offered.get(net, TRUE)))
                     for net in outputs if net in now]
            values = f.solve(f.both(known, f.any_of([*differ.values(), *shows])),
                             [*differ.values(), *shows], seconds=self._seconds)
            if values is False:
                return True
            found = [key for key, item in differ.items() if values and values[item]]
            if not found:
                return False
            for q, state in found:
                if state is None:
                    other[q] = f.variable()
                    same_in[q] = set(range(len(states)))
                else:
                    same_in[q].discard(state)
        return False

    def _states(self, u: Unrolled) -> list[tuple[int, int]]:
        """Return of every code of every state machine whether it is now, and whether it is next."""
        f, made = u.formulas, []
        for places in self.netlist.machines:
            flops = [self.netlist.flops[place] for place in places]
            for code in range(1 << len(flops)):
                now, after = (f.all_of(u.at(0, net) ^ 1 ^ (code >> bit & 1)
                                       for bit, net in enumerate(nets))
                              for nets in ([flop.q for flop in flops], [flop.d for flop in flops]))
                made.append((now, after))
        return made

    def _equal_after_upsets(self, number: int) -> bool:
        u = self._from("upset", UPSET)
        f = u.formulas
        changed = u.mutant(number, UPSET)
        offered = _offered(self.netlist)
        used, shown = u.at(0, self.netlist.start), NO
        for clock in range(UPSET):
            for net in self.netlist.assumed:
                used = f.both(used, u.at(clock, net))
            for bits in self.netlist.outputs.values():
                for net in bits:
                    if net in changed[clock]:
                        differ = f.both(f.differ(u.at(clock, net), changed[clock][net]),
                                        u.at(clock, offered.get(net, TRUE)))
                        shown = f.either(shown, f.both(used, differ))
        return f.solve(shown, seconds=self._seconds) is False
