"""What the record is of: designs, properties, models, stimulus and benches by what they do.

Nothing here depends on how a source file is written. Of a design and of properties the RTLIL in its
canonical form counts; of a model and of stimulus some ten thousand rows of what they give; of a
bench the levels of the inputs that it drives, and what it expects; of the check of a session with a
serial line what it finds where the machine is silent.
"""

import functools
import hashlib
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import islice
from typing import TypeVar

import numpy as np
from amaranth import Value
from amaranth.lib import wiring

from tb.bench import CheckFailed, Run
from tb.benches import benches, groups
from tb.design import Design
from tb.engines import source
from tb.fuzz import FuzzTarget
from tb.fuzz.inputs import random_inputs
from tb.machines import machines
from tb.netlist.subject import Subject, elaborate
from tb.netlist.unknown import Runnable
from tb.registry import components, duts, fuzz_targets, netlist_parts
from tb.rtlil import canonical, fingerprint
from tb.runners import ModelRunner, stimuli

__all__ = ["names", "take"]

T = TypeVar("T", Subject, Runnable)

ROWS, INPUTS, CLOCKS = 30_000, 500, 1000
"""Rows of stimulus, inputs to a serial line, and clocks for a netlist, that are taken."""


def names(kind: str) -> list[str]:
    """Name all of a kind that there are, each with its kind before it.

    Parameters
    ----------
    kind : str
        ``contract``: a component with its properties, in every case; ``bench``: what a bench of a
        component or a machine does; ``run``: a design that is cosimulated, with its model and its
        stimulus; ``fuzz``, ``faults``: a design with what is done to it; ``model``: what the models
        of a machine say of some work; ``netlist``: a design that is checked as a netlist.
    """
    return [f"{kind} {name}" for name in _KINDS[kind][0]()]


def take(wanted: Iterable[str], jobs: int | None = None) -> dict[str, str]:
    """Return the fingerprint of each, in hexadecimal; takes seconds each at most.

    Parameters
    ----------
    wanted : iterable of str
        As :func:`names` names them. What there is no more has the fingerprint ``gone``.
    jobs : int, optional
        Processes; as many as there are cores by default.
    """
    wanted = list(dict.fromkeys(wanted))
    with ProcessPoolExecutor(jobs or os.cpu_count()) as pool:
        return dict(zip(wanted, pool.map(_one, wanted), strict=True))


def _one(name: str) -> str:
    kind, _, which = name.partition(" ")
    known, text = _KINDS[kind]
    return fingerprint(*text(which))[:16] if which in known() else "gone"


def _contract(name: str) -> Iterator[str]:
    for case in components()[name].cases:
        yield str(case)
        yield canonical(components()[name].contract(case).rtlil())


class _RecordedRun(Run):
    """A run of a bench, of which the inputs and the checks are recorded."""

    def __init__(self) -> None:
        super().__init__()
        self.record: list[str] = []

    def simulate(self, dut: wiring.Component, test: Callable, *runners: Callable,
                 inside: Sequence[str] = (), deadline: int = 10_000) -> None:
        ports = [Value.cast(port) for _, member, port in dut.signature.flatten(dut)
                 if member.flow == wiring.In]

        async def record(ctx) -> None:
            while True:
                self.record.append(str([ctx.get(port) for port in ports]))
                await ctx.tick()

        super().simulate(dut, test, *runners, record, inside=inside, deadline=deadline)

    def expect(self, what: str, seen: object, expected: object, *, bits: int | None = None) -> None:
        self.record.append(f"{self.clock} {what} {expected!r}")
        super().expect(what, seen, expected, bits=bits)


def _bench(name: str) -> Iterator[str]:
    run = _RecordedRun()
    try:
        benches()[name].function(run)
    except CheckFailed as error:  # whatever was recorded of it, it is another now
        yield str(error)
    yield from run.record


def _run(name: str) -> Iterator[str]:
    dut = duts()[name]
    yield _design(dut.shared)
    if dut.shared.vhdl is not None:
        for path in dut.shared.vhdl.files:
            code = re.sub(r"--.*", "", path.read_text(encoding="utf-8"))
            yield " ".join(re.findall(r"\w+|\S", code.lower()))
    model = ModelRunner(dut.model()) if dut.model is not None else None
    for block in stimuli(dut, 1, ROWS):
        yield _rows(block)
        if model is not None:
            yield _rows(model.apply(block, list(dut.shared.outputs)))


def _fuzz(name: str) -> Iterator[str]:
    target = fuzz_targets()[name]
    for one in (target, *target.others):
        yield _design(one.design())
        yield from _findings(one)
    for protocol in dict.fromkeys((target.protocol, *(one.protocol for one in target.others))):
        for item in islice(random_inputs(protocol, 1, ROWS, target.period), INPUTS):
            yield _rows({"levels": item.levels} | (
                {} if item.pressed is None else {"pressed": item.pressed}))


def _findings(target: FuzzTarget) -> Iterator[str]:
    """Yield what the check of a session finds where it is silent and nothing moves."""
    inputs = random_inputs(target.protocol, 1, INPUTS, target.period)
    line = np.concatenate([item.levels for item in inputs])
    seen = {name: np.full(len(line), name == "tx", np.int64) for name in target.outputs}
    seen |= {name: np.zeros(len(line), np.int64) for name in target.switches}
    found = target.check(line, seen)
    yield repr((found.bytes, found.lines, found.answers))
    yield from map(repr, found.failures)


def _faults(name: str) -> Iterator[str]:
    builds = machines()[name].faults
    for make in (builds() if builds else {}).values():
        build = make()
        yield _design(build.design)
        for rows in (build.work(1), build.work_to_reset(1, 0), build.work_to_reset(1, 1)):
            yield _rows({"levels": rows.levels, "clocks": rows.clocks, "waits": rows.waits})


def _model(name: str) -> Iterator[str]:
    modelled = machines()[name].modelled
    yield from modelled()() if modelled else ()


def _netlist(name: str) -> Iterator[str]:
    subjects, runnables = _subjects()
    for subject in subjects.get(name, ()):
        yield _design(elaborate(subject.make, subject.mistake))
        yield repr((subject.running, subject.shows, subject.rams))
    for runnable in runnables.get(name, ()):
        yield _design(runnable.make())
        for resets in (True, False):
            for rows, _ in zip(runnable.stimulus(1, CLOCKS, resets), range(2), strict=False):
                yield _rows(rows)


def _design(design: Design) -> str:
    return canonical(source.rtlil(design))


def _rows(rows: Mapping) -> str:
    key = hashlib.sha256()
    for name, levels in rows.items():
        key.update(name.encode())
        key.update(np.asarray(levels).astype(np.int64).tobytes())
    return key.hexdigest()


@functools.cache
def _subjects() -> tuple[dict[str, list[Subject]], dict[str, list[Runnable]]]:
    """Return all designs that are checked as netlists, and what is run of them, by name.

    What a tool flow is given of a board is made of the design that is among them by itself.
    """
    parts = netlist_parts().values()
    subjects = [subject for part in parts for subject in (
        *part.equal, *part.codes, *part.pins, *(subject for subject, _ in part.flipped),
        *(subject for found in part.mistakes.values() for subject, _ in found))]
    return (_by_name(dict.fromkeys(subjects)),
            _by_name(runnable for part in parts for runnable in part.unknown))


def _by_name(items: Iterable[T]) -> dict[str, list[T]]:
    found: dict[str, list[T]] = {}
    for item in items:
        found.setdefault(item.name, []).append(item)
    return found


_KINDS: Mapping[str, tuple[Callable[[], Iterable[str]], Callable[[str], Iterable[str]]]] = {
    "contract": (components, _contract),
    "bench": (lambda: [bench.name for group in ("components", "machine")
                       for bench in groups()[group]], _bench),
    "run": (duts, _run),
    "fuzz": (fuzz_targets, _fuzz),
    "faults": (
        lambda: [name for name, machine in machines().items() if machine.faults], _faults),
    "model": (
        lambda: [name for name, machine in machines().items() if machine.modelled], _model),
    "netlist": (lambda: dict.fromkeys(name for kind in _subjects() for name in kind), _netlist),
}
