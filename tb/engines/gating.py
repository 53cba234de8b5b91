"""Conditional evaluation of a design that Yosys' `write_cxxrtl` has written.

Most of a machine stands still in most clocks: a planner that has nothing to plan, a line on which
nothing comes. So its logic, a list of statements in the order of their data flow, is cut into
segments, each of statements of one module that have data flow in common or read much the same, and
a segment is evaluated only when something that it reads has changed: an input, a register, a
memory, or a value of a segment before. What a segment gives depends on nothing else, so all
registers and outputs are in every clock as if all of it were evaluated.

The idea is that of Beamer and Donofrio, "Efficiently exploiting low activity factors to accelerate
RTL simulation", DAC 2020.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import groupby

__all__ = ["gated", "statements"]

#: Names of values and registers, of locals, and of memories.
NAME = re.compile(r"\b(?:p|i|memory)_(?!index\b)\w+")

#: What is called seldom is not made a part of what calls it.
APART = "__attribute__((noinline))"

#: Bits of a word of flags.
WORD = 64

#: What part of all that two segments of a module read both must read to be one. With less, much is
#: evaluated that has not changed; with more, calls take longer than what they evaluate.
ALIKE = 0.2


@dataclass(eq=False)
class Statement:
    """A statement of the logic, or some that belong together.

    Attributes
    ----------
    text : str
        Its lines.
    values, registers, memories : set of str
        What it changes: values at once, registers and memories at the end of the clock.
    reads : set of str
        What it needs, by name.
    module : tuple of str, optional
        Path of the module that it is from.
    """

    text: str
    values: set[str] = field(default_factory=set)
    registers: set[str] = field(default_factory=set)
    memories: set[str] = field(default_factory=set)
    reads: set[str] = field(default_factory=set)
    module: tuple[str, ...] | None = None


def statements(lines: str) -> list[Statement]:
    """Return the statements of the logic, in their order.

    Parameters
    ----------
    lines : str
        The body of ``eval``, without declarations of locals.
    """
    texts: list[str] = []
    depth, shared = 0, None
    for line in lines.splitlines(keepends=True):
        if line.lstrip().startswith("//"):
            continue
        if depth or (shared and re.search(rf"\b{shared}\b", line)):
            texts[-1] += line
        else:
            texts.append(line)
            begun = re.match(r"\tauto (tmp_\d+) = ", line)
            shared = begun[1] if begun else None
        depth += line.count("{") - line.count("}")
    return [_statement(text) for text in texts]


def _statement(text: str) -> Statement:
    made = Statement(text)
    rest = text
    for left in re.findall(r"^\s*((?:p_|i_)[^=\n]*?) = ", text, re.M):
        names = NAME.findall(left)
        (made.registers if ".next" in left else made.values).update(names)
        rest = rest.replace(f"{left} = ", " ", 1)
    made.memories.update(re.findall(r"\b(memory_\w+)\.update\(", text))
    made.reads.update(NAME.findall(rest))
    if ".next" in rest:
        raise ValueError(f"the next value of a register is read: {text}")
    made.module = _module(next(iter(sorted(made.values | made.registers | made.memories)), ""))
    return made


def _module(name: str) -> tuple[str, ...] | None:
    """Return the path of the module that a name is from; None if the name does not say it."""
    if re.match(r"i_(?!flatten)", name):
        return None
    parts = re.sub(r"^(?:memory_)?(?:p|i_flatten|i)_", "", name).split("_2e_")
    return tuple(re.sub(r"^_?5c_", "", part) for part in parts[:-1])


@dataclass(eq=False)
class Segment:
    """Statements that are evaluated together, or not at all."""

    statements: list[Statement]
    number: int = 0

    @property
    def flag(self) -> tuple[int, int]:
        """The word of its flag, and the bit there."""
        return self.number // WORD, 1 << self.number % WORD

    def all(self, what: str) -> set[str]:
        """Return what its statements have under a name."""
        return set().union(*(getattr(each, what) for each in self.statements))

    def likeness(self, other: "Segment") -> float:
        """Return the part that both read of all that one of them reads."""
        mine, others = (each.all("reads") - each.all("values") for each in (self, other))
        return len(mine & others) / len(mine | others) if mine | others else 1


def _place(every: Sequence[Statement]) -> None:
    """Give statements whose names say no module that of what reads them."""
    wanted: dict[str, Counter] = {}
    for each in reversed(every):
        if each.module is None:
            votes = sum((wanted.get(name, Counter()) for name in sorted(each.values)), Counter())
            each.module = votes.most_common(1)[0][0] if votes else ()
        for name in each.reads:
            wanted.setdefault(name, Counter())[each.module] += 1


def _segments(every: Sequence[Statement]) -> list[Segment]:
    """Order statements so that those of a module come together as far as their data flow lets.

    Of the modules whose statements have what they need it takes the one of which most can follow
    each other, again and again. Statements that only registers wait for come as late as a segment
    of their module does; those that write memories are last, in segments of their own.
    """
    _place(every)
    flow = [each for each in every if each.values]
    writers: dict[str, list[int]] = {}
    needs: list[set[int]] = []
    for number, each in enumerate(flow):
        before = {other for name in each.reads | each.values for other in writers.get(name, ())}
        needs.append(before)
        for name in each.values:
            writers.setdefault(name, []).append(number)
    users: dict[int, list[int]] = {}
    for number, before in enumerate(needs):
        for other in before:
            users.setdefault(other, []).append(number)
    left = [len(before) for before in needs]
    ready: dict[tuple[str, ...], list[int]] = {}
    for number, count in enumerate(left):
        if not count:
            ready.setdefault(flow[number].module or (), []).append(number)

    def closure(module: tuple[str, ...]) -> list[int]:
        found, missing = list(ready[module]), dict[int, int]()
        for number in found:
            for user in users.get(number, ()):
                missing[user] = missing.get(user, left[user]) - 1
                if not missing[user] and flow[user].module == module:
                    found.append(user)
        return found

    segments: list[Segment] = []
    while ready:
        chosen = max((closure(module) for module in ready), key=len)
        module = flow[chosen[0]].module or ()
        del ready[module]
        segments.append(Segment([flow[number] for number in chosen]))
        for number in chosen:
            for user in users.get(number, ()):
                left[user] -= 1
                if not left[user] and flow[user].module != module:
                    ready.setdefault(flow[user].module or (), []).append(user)
    return [part for each in segments + _ends(every, segments) for part in _parts(each)]


def _ends(every: Sequence[Statement], segments: Sequence[Segment]) -> list[Segment]:
    """Put statements that change registers into segments, or give further ones of them."""
    written = {name: place for place, segment in enumerate(segments)
               for name in segment.all("values")}
    last = {segment.statements[0].module: place for place, segment in enumerate(segments)}
    rest = []
    for each in every:
        if each.values:
            continue
        place = last.get(each.module, -1)
        if segments and not each.memories and all(
                written.get(name, -1) <= place for name in each.reads):
            segments[place].statements.append(each)
        else:
            rest.append(each)
    rest.sort(key=lambda each: (bool(each.memories), each.module or ()))
    return [Segment(list(group)) for _, group in groupby(
        rest, key=lambda each: (bool(each.memories), each.module))]


def _parts(segment: Segment) -> list[Segment]:
    """Cut a segment into what has no data flow in common, but for parts that read much the same."""
    if segment.all("memories"):
        return [segment]
    flows: list[Segment] = []
    for each in segment.statements:
        joined = [flow for flow in flows if flow.all("values") & (each.reads | each.values)]
        flows = [flow for flow in flows if flow not in joined]
        flows.append(Segment([*(one for flow in joined for one in flow.statements), each]))
    parts: list[Segment] = []
    for flow in flows:
        alike = max(parts, key=flow.likeness, default=None)
        if alike and flow.likeness(alike) >= ALIKE:
            alike.statements += flow.statements
        else:
            parts.append(flow)
    return parts


class _Writer:
    """Writes segments in C++, with a flag for each that something it reads has changed."""

    def __init__(self, module: str, edge: str, lines: str) -> None:
        # Some locals hide a member of the same name, which is for waveforms.
        hiding = set(re.findall(r"^\tvalue<\d+> p_(\w+);\n", lines, re.M))
        lines = re.sub(r"\bp_(\w+)", lambda found: (
            f"i_{found[1]}" if found[1] in hiding else found[0]), lines)
        self._module, self._edge = module, edge
        self._locals = {name: kind
                        for kind, name in re.findall(r"^\t(value<\d+>) (\w+);\n", lines, re.M)}
        found = _segments(statements(re.sub(
            r"^\t(?:value<\d+> \w+;|bool \w+ = [^\n]*;)\n", "", lines, flags=re.M)))
        self.stores = [each for each in found if each.all("memories")]
        self.flow = [each for each in found if each not in self.stores]
        # What writes memories has flags in words of its own, and runs once a clock.
        begin = -(-len(self.flow) // WORD) * WORD
        for first, of in ((0, self.flow), (begin, self.stores)):
            for number, each in enumerate(of, first):
                each.number = number
        self.words = -(-(begin + len(self.stores)) // WORD) or 1
        self._readers: dict[str, list[Segment]] = {}
        self._homes: dict[str, set[int]] = {}
        for each in found:
            for name in each.all("reads") | each.all("memories"):
                self._readers.setdefault(name, []).append(each)
            for name in each.all("reads") | each.all("values"):
                self._homes.setdefault(name, set()).add(each.number)

    @property
    def all(self) -> list[Segment]:
        """All segments, in the order in which they are evaluated."""
        return self.flow + self.stores

    @property
    def shared(self) -> list[str]:
        """Declarations of locals of `eval` that several segments have in common."""
        return [f"{kind} {name};" for name, kind in self._locals.items()
                if len(self._homes.get(name, ())) > 1]

    def wake(self, name: str, but: Segment | None = None) -> str:
        """Raise the flags of the segments that read a name, but for one."""
        masks = [0] * self.words
        for each in self._readers.get(name, ()):
            word, bit = each.flag
            if each is not but:
                masks[word] |= bit
        return " ".join(f"dirty[{word}] |= {mask:#x}ull;"
                        for word, mask in enumerate(masks) if mask)

    def evaluate(self, each: Segment) -> list[str]:
        """Define the function that evaluates a segment."""
        outside = [name for name in sorted(each.all("values")) if self.wake(name, each)]
        word, bit = each.flag
        return [
            f"void {self._module}::segment_{each.number}() {{",
            f"\tconstexpr bool {self._edge} = true; (void){self._edge};",
            *([f"\tran[{word}] |= {bit:#x}ull;"] if each.all("registers") else []),
            *(f"\t{kind} {name};" for name, kind in self._locals.items()
              if self._homes.get(name) == {each.number}),
            *(f"\tauto was_{name} = {name};" for name in outside),
            *(one.text.rstrip("\n") for one in each.statements),
            *(f"\tif ({name} != was_{name}) {{ {self.wake(name, each)} }}"
              for name in outside), "}"]

    def take(self, each: Segment) -> list[str]:
        """Define the function by which registers of a segment take their next values."""
        names = sorted(each.all("registers"))
        return [f"void {self._module}::take_{each.number}() {{", *(
            f"\tif ({name}.curr != {name}.next) {{ {name}.curr = {name}.next; {self.wake(name)} }}"
            for name in names), "}"] if names else []

    def table(self, function: str, every: Sequence[Segment]) -> str:
        """Define a table of functions of segments, by their numbers."""
        calls = {each.number: f"[]({self._module} *self) {{ self->{function}_{each.number}(); }}"
                 for each in every}
        return (f"static constexpr void (*{function}[])({self._module} *) = {{\n\t"
                + ",\n\t".join(calls.get(n, "nullptr") for n in range(self.words * WORD)) + "};")

    def call(self, function: str, flags: str, words: range) -> list[str]:
        """Call a function of each segment with a flag up, also of those that it raises behind it.

        A branch for each flag would take longer, and so would one call for all words, whose target
        no processor foresees.
        """
        return [
            f"\tfor (uint64_t bit, later = -1; (bit = {flags}[{word}] & later); "
            f"later = -(bit << 1)) {{ bit &= -bit; {flags}[{word}] ^= bit; "
            f"{function}[{WORD * word} + __builtin_ctzll(bit)](this); }}" for word in words]


def gated(module: str, edge: str, lines: str, inputs: Sequence[str],
          memories: Sequence[str]) -> tuple[str, list[str], str]:
    """Return members of the module for conditional evaluation, and their definitions.

    Those of segments come one by one, so that they may be compiled apart, then all others.

    ``inputs()`` looks at the inputs, ``outputs()`` settles the outputs, ``next()`` makes a clock,
    and ``wake()`` has all of it evaluated again, at first and after something else has changed the
    state.

    Parameters
    ----------
    module : str
        The class in C++.
    edge : str
        Name of the clock edge in `lines`.
    lines : str
        The body of ``eval``.
    inputs, memories : sequence of str
        Members that hold what comes from outside, and memories.
    """
    write = _Writer(module, edge, lines)
    taking = [each for each in write.all if each.all("registers")]
    inputs = [name for name in inputs if write.wake(name)]
    flags = [sum(each.flag[1] for each in write.all if each.flag[0] == word)
             for word in range(write.words)]
    flow = -(-len(write.flow) // WORD)
    members = [
        *write.shared, f"uint64_t dirty[{write.words}], ran[{write.words}];",
        *(f"decltype({name}) was_{name};" for name in inputs),
        "void wake();", "void inputs();", "void outputs();", "void next();",
        *(f"{APART} void segment_{each.number}();" for each in write.all),
        *(f"{APART} void take_{each.number}();" for each in taking)]
    segments = ["\n".join([*write.evaluate(each), *write.take(each), ""]) for each in write.all]
    return "".join(f"\t{member}\n" for member in members), segments, "\n".join([
        write.table("segment", write.all), write.table("take", taking),
        f"void {module}::wake() {{",
        *(f"\tdirty[{word}] = {mask:#x}ull;" for word, mask in enumerate(flags)),
        "\tmemset(ran, 0, sizeof(ran));", "}",
        f"void {module}::inputs() {{",
        *(f"\tif ({name} != was_{name}) {{ was_{name} = {name}; {write.wake(name)} }}"
          for name in inputs), "}",
        f"void {module}::outputs() {{", *write.call("segment", "dirty", range(flow)), "}",
        f"void {module}::next() {{", "\tobserver observer;", "\toutputs();",
        *write.call("segment", "dirty", range(flow, write.words)),
        *write.call("take", "ran", range(write.words)),
        *(f"\tif ({name}.commit(observer)) {{ {write.wake(name)} }}" for name in memories),
        "}", ""])
