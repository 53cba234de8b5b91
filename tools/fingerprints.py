"""What the record is of: designs, properties, models and stimulus by what they are and do.

Nothing here depends on how a source file is written. Of a design and of properties the RTLIL in its
canonical form counts; of a model and of stimulus some thousand rows of what they give.
"""

import functools
import hashlib
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from itertools import islice

import numpy as np

from tb.design import Design
from tb.engines import source
from tb.fuzz.inputs import random_inputs
from tb.machines import machines
from tb.netlist.subject import Subject
from tb.registry import components, duts, fuzz_targets, netlist_parts
from tb.rtlil import canonical, fingerprint
from tb.runners import ModelRunner, stimuli

__all__ = ["names", "take"]

ROWS, INPUTS = 2000, 200
"""Rows of stimulus, and inputs to a serial line, that are looked at."""


def names(kind: str) -> list[str]:
    """Name all of a kind that there are, each with its kind before it.

    Parameters
    ----------
    kind : str
        ``contract``: a component with its properties, in every case; ``run``: a design that is
        cosimulated, with its model and its stimulus; ``fuzz``, ``faults``: a design with what is
        done to it; ``netlist``: a design with the times that are built.
    """
    return [f"{kind} {name}" for name in _KINDS[kind][0]()]


def take(wanted: Iterable[str], jobs: int | None = None) -> dict[str, str]:
    """Return the fingerprint of each, in hexadecimal; takes a second each at most.

    Parameters
    ----------
    wanted : iterable of str
        As :func:`names` names them. What there is no more has the fingerprint ``gone``.
    jobs : int, optional
        Processes; as many as there are cores, unless told otherwise.
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
    for item in islice(random_inputs(target.protocol, 1, ROWS, target.period), INPUTS):
        yield _rows({"levels": item.levels})


def _faults(name: str) -> Iterator[str]:
    builds = machines()[name].faults
    for make in (builds() if builds else {}).values():
        build = make()
        yield _design(build.design)
        for rows in (build.work(1), build.work_to_reset(1, 0), build.work_to_reset(1, 1)):
            yield _rows({"levels": rows.levels, "clocks": rows.clocks, "waits": rows.waits})


def _netlist(name: str) -> Iterator[str]:
    yield _design(_subjects()[name].make())


def _design(design: Design) -> str:
    return canonical(source.rtlil(design))


def _rows(rows: Mapping) -> str:
    key = hashlib.sha256()
    for name, levels in rows.items():
        key.update(name.encode())
        key.update(np.asarray(levels).astype(np.int64).tobytes())
    return key.hexdigest()


@functools.cache
def _subjects() -> dict[str, Subject]:
    return {one.name: one for part in netlist_parts().values()
            for one in (*part.equal, *part.codes, *part.pins)}


_KINDS: Mapping[str, tuple[Callable[[], Iterable[str]], Callable[[str], Iterable[str]]]] = {
    "contract": (components, _contract),
    "run": (duts, _run),
    "fuzz": (fuzz_targets, _fuzz),
    "faults": (
        lambda: [name for name, machine in machines().items() if machine.faults], _faults),
    "netlist": (_subjects, _netlist),
}
