"""The record of verification as a page, from the figures of the commands and from nothing else."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

__all__ = ["dump", "page", "summary"]

Facts: TypeAlias = Mapping[str, Any]

HEAD = """\
# Verification

What was checked, with what, and what came of it. `python -m tools.record` wrote this page from the
figures of the commands named below each heading; `verification.json` beside it has the same figures
for programs, and fingerprints of the designs, properties, models, stimulus and benches that they
are of: `python -m tools.record --check` compares these with what is here. Nothing here was typed by
hand.
"""

def summary(name: str, figures: Facts) -> Facts:
    """Keep of a part's figures what the record has room for.

    Parameters
    ----------
    name : str
        Of the part, see :func:`tools.record.parts`.
    figures : mapping
        What its command wrote.
    """
    return _SHORTER[_kind(name)](figures) if _kind(name) in _SHORTER else figures


def _kind(name: str) -> str:
    """Return what a part is, whichever machine it is of: ``engines`` of ``engines-mill``."""
    return name.partition("-")[0]


def dump(facts: Any, indent: str = "") -> str:
    """Write facts as JSON, in a line what holds nothing that holds more."""
    if not isinstance(facts, list | Mapping) or not any(
            isinstance(one, list | Mapping)
            for one in (facts.values() if isinstance(facts, Mapping) else facts)):
        return json.dumps(facts) + ("" if indent else "\n")
    inner = f"{indent} "
    if isinstance(facts, Mapping):
        lines = [f"{json.dumps(name)}: {dump(value, inner)}" for name, value in facts.items()]
    else:
        lines = [dump(value, inner) for value in facts]
    first, last = "{}" if isinstance(facts, Mapping) else "[]"
    text = f",\n{inner}".join(lines)
    return f"{first}\n{inner}{text}\n{indent}{last}" + ("" if indent else "\n")


def page(record: Facts) -> str:
    """Write the record as Markdown; `record` is what ``verification.json`` holds."""
    parts = record["parts"]
    text = [HEAD]
    for section in _SECTIONS:
        there, missing = ([name for name in names if _kind(name) in section.kinds]
                          for names in (parts, record.get("left_out", ())))
        if not there and not missing:  # of a record that was before there was such a part
            continue
        text.append(f"## {section.title}")
        if there and (section.apart or not missing):
            text += [*(f"- `{part['command']}`, {_seconds(part['seconds'])}{_resumed(part)}"
                       for part in map(parts.__getitem__, there)), "", section.text,
                     *(parts[name]["about"] for name in there if "about" in parts[name]), ""]
            text += section.write(*(parts[name]["facts"] for name in there))
        if missing:
            text += ["", f"Left out of this record: {', '.join(missing)}.", ""]
    text.append(_origin(record))
    return "\n".join(text)


# Sections


def _engines(*runs: Facts) -> list[str]:
    text = []
    for facts in runs:
        name = facts["machine"]
        if "agree" in facts and "engines" not in facts:  # a campaign
            text += [f"{_and(facts['clocks_per_second'])} agree over a campaign of "
                     f"{_many(facts['clocks'])} clocks of {name}, checksum `{facts['checksum']}`.",
                     ""]
            continue
        rows = [[engine, one["version"] or "-", _many(one["clocks"]),
                 _many(one["clocks_per_second"])] for engine, one in facts["engines"].items()]
        text += [_table([f"{name} on", "version", "clocks", "clocks/s"], rows),
                 f"All agree, seed {facts['seed']}, checksum `{facts['checksum']}`.", ""]
    return text


def _contracts(*runs: Facts) -> list[str]:
    proofs, kills = (next((run for run in runs if all(
        what in one for one in run["components"].values())), None) for what in ("hold", "killed"))
    if proofs is None:
        return []
    rows = []
    for name, one in proofs["components"].items():
        own = kills["components"].get(name) if kills else None
        rows.append([
            name, one["properties"], one["proofs"], one["hold"], one["k"], f"{one['seconds']:.1f}",
            f"{own['killed']} of {own['killed'] + len(own['none'])}" if own else "-",
            own["lemmas"] if own else "-"])
    found = [[name, one] for name, own in (kills["components"] if kills else {}).items()
             for one in own["none"]]
    return [
        _table(["component", "properties", "proofs", "hold", "largest k", "s",
                "broken by a mutant", "lemmas"], rows),
        f"{sum(one['properties'] for one in proofs['components'].values())} properties in all"
        + (f", of {proofs['sentences']} different sentences: axes have the same ones, and so do a "
           "part and a machine that contains it" if "sentences" in proofs else "")
        + ". `python -m tools.prove --list` names them"
        + ("; `properties.json` beside this page has the mutant of each." if kills else "."), "",
        *(["No mutant was found that breaks these:", "", _table(["component", "property"], found)]
          if found else [])]


def _vhdl(vhdl: Facts) -> list[str]:
    rows = [[one["name"], f"`tb/vhdl/{one['entity']}.vhd`", _many(one["clocks"]),
             f"`{one['checksum']}`", f"{one['hold']} of {one['proofs']}", one["k"],
             f"{one['found']} of {one['mistakes']}"] for one in vhdl["components"]]
    return [_table(["component", "entity", "clocks in step", "checksum", "proofs", "largest k",
                    "mistakes found"], rows)]


def _netlist(netlist: Facts) -> list[str]:
    rows = [[part["check"], part["design"], part["control"] or "-", part["summary"],
             "as it must be" if part["good"] else "WRONG", f"{part['seconds']:.1f}"]
            for part in netlist["parts"]]
    rows += [[check, design, "-", why, "left out", "-"]
             for check, designs in netlist["left_out"].items() for design, why in designs.items()]
    return [_table(["check", "design", "mistake planted", "found", "", "s"], rows)]


def _mutants(*runs: Facts) -> list[str]:
    counts = ("mutants", "equivalent", "broken", "unproved", "bench", "killed", "survive")
    total = {count: sum(run["all"][count] for run in runs) for count in counts}
    score = 100 * total["killed"] / max(1, total["mutants"] - total["equivalent"])
    parts = [item for run in runs for item in run["components"].items()]
    possible = sum(one["possible"] for _, one in parts)
    rows = [[name, _many(one["possible"]), *(one[count] for count in counts), f"{one['score']:.2f}"]
            for name, one in [*parts, ("**all**", {**total, "possible": possible, "score": score})]]
    text = [_table(["component", "possible", "tried", "equivalent", "break a property",
                    "only lose the proof", "noticed by the bench", "killed", "survive",
                    "% killed"], rows)]
    without = [name for run in runs for name in run.get("without", ())]
    if without:
        text += [f"Of these, which have no bench of their own, none were made: {_and(without)}.",
                 ""]
    survivors = [[one["component"], f"`{one['mutant']}`", one["explained"] or "not explained"]
                 for run in runs for one in run["survivors"]]
    if survivors:
        text += ["What nothing found:", "", _table(["component", "mutant", "why"], survivors)]
    return text


def _fuzz(*runs: Facts) -> list[str]:
    machines = [machine for run in runs for machine in run["machines"]]
    counts = ("bytes", "sessions", "clocks", "lines", "answers", "steps")
    rows = [[one["name"], *(_many(one[count]) for count in counts),
             "nothing" if one["good"] else "WRONG"] for one in machines]
    timed = [[one["name"], times["motors"], _many(times["rates"]), _many(times["steps"]),
              f"{times['deviation']:.4f}", times["beyond_rounding"]]
             for one in machines if (times := one.get("times"))]
    kinds = _in_order(kind for one in machines for kind in one["pieces"] if kind != "rest")
    sent = [[one["name"], *(_many(one["pieces"].get(kind, 0)) for kind in kinds)]
            for one in machines]
    return [_table(["machine", *counts, "found"], rows), "What was sent, in pieces:", "",
            _table(["machine", *kinds], sent),
            "Step times at the pins, all motors at once, each step compared with its exact time:",
            "", _table(["machine", "motors", "rates", "steps", "most clocks apart",
                        "clocks beyond rounding"], timed)]


def _instants(*runs: Facts) -> list[str]:
    text = []
    for run in runs:
        rows = [[kind, one["programs"], _many(one["blocks"]), _many(one["steps"]),
                 _many(one["fastest"]), *(f"{each:+.1f}" for each in one["clocks"]),
                 f"{100 * one['share'][3]:.1f}",
                 *(" to ".join(f"{one[what][end]:+.2f}" for end in (0, -1))
                   for what in ("tick_clocks", "begins")), one["late"]]
                for kind, one in run["steps"].items()]
        text += [_table(["programs", "", "blocks", "steps", "most steps/s", "least", "median",
                         "99 %", "99.9 %", "most", "99.9 % of the time to the next step, %",
                         "their ticks", "begins of motions", "late"], rows)]
        ticks = [[blocks, one["programs"], one["seconds"], f"{one['least']:+.2f}",
                  f"{one['most']:+.2f}", one["p50"], one["p99"], one["late"]]
                 for blocks, one in run["ticks"].items()]
        if ticks:
            text += ["Ticks of the profile by itself:", "", _table(
                ["blocks", "programs", "s of movement", "least", "most",
                 "worst of a program, median", "99 %", "late"], ticks)]
    return text


def _ends(*runs: Facts) -> list[str]:
    rows = [[where, *(_many(one[what]) for what in ("blocks", "arcs", "lines", "steps")),
             _many(one.get("places", one["lines"])), one["off"], one["most"]]
            for run in runs for where in ("model", "gateware") if (one := run.get(where))]
    return [_table(["on the", "blocks", "arcs", "lines", "steps", "ends compared", "off",
                    "by steps at most"], rows)]


def _limits(*runs: Facts) -> list[str]:
    rows = [[quantity, _many(one["measured"]), _many(one["unresolved"]),
             *(f"{one[part]:.3f}" for part in ("error", "highest", "least")),
             "yes" if one["measured"] and one["least"] <= 1 else "**no**"]
            for run in runs for quantity, one in run["limits"].items()]
    return [_table(["", "measured", "not resolved", "error", "highest", "less its error",
                    "within"], rows)]


def _planning(*runs: Facts) -> list[str]:
    rows = [[_many(run["depth"]), _many(facts["pass_clocks"][str(run["depth"])]),
             _many(run["lines"]), *(_many(round(run[part])) for part in (
                 "speed", "by_depth", "by_lines")), run["waiting"], run["brakes"], run["empty"]]
            for facts in runs for run in facts["runs"]]
    return [_table(["blocks of the queue", "clocks of a pass", "lines/s", "mm/min", "by depth",
                    "by lines", "blocks that wait", "brake", "find it empty"], rows)]


def _arcs(*runs: Facts) -> list[str]:
    rows = [[setting, _many(one["arcs"]), _many(one["turns"]), _many(one["steps"]),
             *(f"{each:.3g}" for part in ("grid", "sync", "end") for each in one[part][1:]),
             f"{100 * one['ripple'][2]:.3g}", one["corrective"], one["beyond"]]
            for run in runs for setting, one in run.items()]
    return [_table(["steps/mm", "arcs", "half turns", "steps", "off the circle, 99 %", "most",
                    "off the place of the moment, 99 %", "most", "end, 99 %", "most",
                    "ripple of speed, most, %", "ends corrected", "by more than a step"], rows)]


def _figures(*runs: Facts) -> list[str]:
    def number(value: float) -> str:
        return f"{value:,.10g}".replace(",", " ")

    def asked(one: Facts) -> str:
        return ", ".join(f"{word} {number(one[end])}" for word, end in (
            ("at least", "least"), ("at most", "most")) if one[end] is not None) or "-"

    rows = [[name, number(one["measured"]), one["unit"], asked(one),
             "yes" if one["right"] else "**no**"] for run in runs for name, one in run.items()]
    return [_table(["", "measured", "", "asked", "reached"], rows)]


def _straight(*runs: Facts) -> list[str]:
    rows = [[f"{one['from']} mm", f"{one['straight']:.3f}",
             *(f"{each:.3f}" for each in one["motors"]), f"{one['geometry']:.3f}",
             one["bound"] or "-", f"{one['bowed']:.0f}"]
            for run in runs for one in run["bands"]]
    return [_table(["y from", "mm from the line", "with motors, at full speed", "at F300",
                    "by geometry at most", "bound", "bowed"], rows),
            *(f"{_many(run['lines'])} lines of {_many(run['ticks'])} ticks; strings are "
              f"{run['error']:g} steps off at most.\n" for run in runs)]


def _resets(*runs: Facts) -> list[str]:
    rows = [[_struck(one), _many(one["resets"]), _many(one["clocks"]), _many(one["steps"]),
             len(one["wrong"])] for run in runs for one in run["machines"]]
    return [_table(["machine", "resets", "clocks", "steps", "wrong"], rows)]


def _upsets(*runs: Facts) -> list[str]:
    verdicts = ("flips", "harmless", "visible", "stuck", "silent")
    rows = [[_struck(one), one["flip_flops"], *(_many(one[verdict]) for verdict in verdicts),
             f"{100 * one['silent_rate']:.3f}"] for run in runs for one in run["machines"]]
    return [_table(["machine", "flip-flops", "upsets", *verdicts[1:], "% silent"], rows)]


def _coverage(*runs: Facts) -> list[str]:
    rows = [[name, one["state"], one["transition"], one["last"]]
            for run in runs for name, one in run.get("states", {}).items()]
    lines = [run["lines"] for run in runs if "lines" in run]
    covered = [[one["machine"], _many(one["clocks"]), what, _many(one[what]["seen"]),
                _many(one[what]["all"]), f"{one[what]['percent']:.2f}", f"{one[what]['least']:g}"]
               for one in lines for what in ("lines and branches", "bits")]
    text = []
    if rows:
        text += [_table(["state machine", "states", "transitions", "last one in clock"], rows)]
    if lines:
        text += [
            f"What the cosimulation covers, as {lines[0]['engine']} counts it. Bits that nothing "
            "can change, such as a parameter fixes, are counted too:", "",
            _table(["machine", "clocks", "", "seen", "of", "%", "least"], covered)]
    return text


def _size(*builds: Facts) -> list[str]:
    capacity = {name: has for name, has in builds[0]["capacity"].items()
                if name in builds[0]["resources"]}
    rows = [[_design(facts), *(facts["resources"][name] for name in capacity)] for facts in builds]
    rows.append(["*a XC3S500E has*", *capacity.values()])
    return [_table(["design", *(name.replace("_", " ") for name in capacity)], rows),
            f"Counted by {builds[0]['resources']['tool']}.", ""]


def _design(facts: Facts) -> str:
    words = [facts["machine"], "by its own pins" if facts["board"] == "pins" else facts["board"],
             *(["with guard"] if facts.get("guard") else []),
             *(["with a ramp"] if facts.get("ramp_steps_per_s2") else []),
             *(["orders over a serial line"] if facts.get("orders") == "serial" else [])]
    return ", ".join(words)


def _origin(record: Facts) -> str:
    return "\n".join([
        "## With what", "",
        f"On {record['cores']} cores, with {', '.join(record['versions'])}.", ""])


@dataclass(frozen=True)
class _Section:
    title: str
    text: str
    kinds: Sequence[str]  # of parts
    write: Callable[..., list[str]]
    apart: bool = False  # each of its parts is of use without the others


_SECTIONS = (
    _Section("Engines in step", """\
The same stimulus, directed and random, for every engine and for the model in Python; every output
of every clock is compared.""", ("engines", "pair", "campaign"), _engines, apart=True),
    _Section("Instants of steps", """\
Random programs of G-code on models that are the gateware to the clock: in which clock of 50 MHz
each rising edge of STEP comes, less the instant at which its axis passes to that step with the
planned accelerations, in 80-bit arithmetic. A step waits for the next tick, which is 2 to 4 clocks
at full speed and longer below it; how far the tick itself is off is shown, too. Instants count from
the begin of each motion from rest; by how many clocks that is later than the one before ends is
shown as well. Late are parts of the speed profile that are over before the next is known. Fast
lines are those of drivers that take pulses of 100 ns. Steps of arcs take 6 or 8 clocks less from
their tick to the pins than those of lines.""", ("instants",), _instants),
    _Section("Ends", """\
Where the axes are, against the text of the program in rational numbers, for all lines so far: on
the model after each line, at the pins of the gateware wherever it rests.""", ("ends",), _ends),
    _Section("Under load and faults", """\
A line without a pause, at the least of clocks a bit that a receiver takes, with real-time bytes
between and within its lines; a sender that sends more than there is room for; noise, breaks and
cuts; holds, cancelled jogs and resets at full speed. Answers are compared with the lines, and the
pins with the sum of those that were answered ok. What is of the model is of lines of the same
kind.""",
             ("load", "hour"), _figures, apart=True),
    _Section("Limits of speed and acceleration", """\
Random programs on the gateware, each with other steps/mm, rates and accelerations for every axis:
what the edges at the STEP pins say of speeds, of accelerations inside a block, and of the step of
velocity between two, as a part of what is allowed. An error is how far the places of edges leave a
ratio open, as a part of the limit, of the median. Not resolved are junctions of blocks of too few
steps, and turns straight back.""", ("limits",), _limits),
    _Section("What it reaches", """\
At the pins of the gateware at 50 MHz. What names no drivers is with the times of an A4988, and with
the steps/mm of the first line; pulses of 100 ns are for drivers that take them.""",
             ("reach",), _figures),
    _Section("Look-ahead", """\
A straight job of segments of 0.05 mm at 500 mm/s², on models: the clocks of a pass that changes all
blocks of the queue, and the speed that is sustained with so many lines a second.""",
             ("planning",), _planning),
    _Section("Arcs", """\
Random arcs on the model of the walk, which is the gateware to the bit: how far places are off, in
steps, with equal and with unequal steps/mm of both axes.""", ("arcs",), _arcs),
    _Section("Straight lines on a wall", """\
Random lines of a hanging plotter, on models that are the gateware to the bit: where a pen hangs
from two strings of so many whole half steps, after each tick of the place; how far that is from the
line that was asked for, and how far from the bowed one of the thesis.""", ("lines",), _straight),
    _Section("Contracts", """\
The properties of each component, proved for every sequence of inputs and for unbounded time, with
reset in any clock: a base case from power-up, and induction over k clocks. A cover reaches every
premise. A mutant of the design that breaks it, where one is named, shows that a property can fail;
lemmas are there for an induction, and need none.""",
             ("proofs", "kills"), _contracts, apart=True),
    _Section("The thesis's blocks in VHDL", """\
Written from the text of the thesis, and compared with the gateware: in step under GHDL, and by
induction for every input. The mistakes are planted in the gateware. What the thesis leaves open the
VHDL has from the gateware; `tb/vhdl/__init__.py` lists it.""", ("vhdl",), _vhdl),
    _Section("The netlist", """\
What Yosys makes of the gateware for the Spartan-3E. Where a mistake is planted the check must find
it.""", ("netlist",), _netlist),
    _Section("Mutants", """\
Small mistakes put into the gateware by Yosys: a sample of those that are possible. A mutant is
killed if a property breaks, if the induction that proves the properties fails, or if the bench of
the component notices it. Those that are proved to change nothing are left out of the score. A
mutant that breaks a property may be counted for the bench, too.""",
             ("mutants",), _mutants, apart=True),
    _Section("Lines", """\
Valid and invalid lines, random bytes, missing stop bits, breaks, glitches, noise and floods into
each serial line. Each line has its one answer; each step lies on the path that a valid line
requested, and comes at its time; the position that is reported is that of the steps. The checks
follow the description of the lines, with no model of the gateware.""",
             ("fuzz",), _fuzz, apart=True),
    _Section("Resets", """\
Resets during work, in random clocks and of random length: no coil word out of the table, no motor
moved, no pulse begun or cut, and afterwards the state of power-up where that is specified. A
machine on a serial line gets a command to move after every 20th, and must obey and answer.""",
             ("resets",), _resets, apart=True),
    _Section("Upsets", """\
One flip-flop upset during work. *Silent* is a motor in a wrong place, or a counter that shows a
wrong one, without an error; an answer on a serial line counts as an error, too. A STEP that an
upset cuts short counts as a step.""", ("flips",), _upsets, apart=True),
    _Section("Coverage", """\
States and transitions to which inputs lead from power-up, found by a solver; those for upset
registers from a code that no state has.""", ("coverage",), _coverage, apart=True),
    _Section("Size", "Of the Spartan-3E.", ("size",), _size, apart=True),
)

# What is too long to keep


def _short_proofs(figures: Facts) -> Facts:
    parts = {}
    for name in _in_order(proof["component"] for proof in figures["proofs"]):
        own = [proof for proof in figures["proofs"] if proof["component"] == name]
        # The seconds of a case are those of all its properties together.
        cases = {proof["case"]: proof["base"] + proof["induction"] for proof in own}
        parts[name] = {
            "properties": len({proof["name"] for proof in own}), "proofs": len(own),
            "hold": _proved(own), "k": max(proof["k"] or 0 for proof in own),
            "seconds": round(sum(cases.values()), 1)}
    return {"versions": figures["versions"], "seconds": figures["seconds"],
            "sentences": len({proof["description"] for proof in figures["proofs"]}),
            "components": parts}


def _short_kills(figures: Facts) -> Facts:
    """Count them by component; of each property its mutant, with the case, and the clock."""
    results = next(value for value in figures.values()
                   if isinstance(value, list) and value and "mutant" in value[0])
    parts, mutants = {}, {}
    for one in results:
        part = parts.setdefault(one["component"], {"killed": 0, "lemmas": 0, "none": []})
        if one["mutant"]:
            part["killed"] += 1
            mutants.setdefault(one["component"], {})[one["name"]] = (
                f"{one['mutant']}, {one['case']}, clock {one['clock']}")
        elif one["lemma"]:
            part["lemmas"] += 1
        else:
            part["none"].append(one["name"])
    return {"versions": figures["versions"], "seconds": figures["seconds"], "components": parts,
            "mutants": mutants}


def _short_vhdl(figures: Facts) -> Facts:
    keys = ("name", "entity", "clocks", "checksum")
    return {**figures, "components": [
        {**_only(one, keys), "proofs": len(one["proofs"]), "hold": _proved(one["proofs"]),
         "k": max((proof["k"] or 0 for proof in one["proofs"]), default=0),
         "mistakes": len(one["controls"]),
         "found": sum(control["clock"] is not None for control in one["controls"])}
        for one in figures["components"]]}


def _short_netlist(figures: Facts) -> Facts:
    keys = ("check", "design", "control", "summary", "good", "seconds")
    return {**figures, "parts": [_only(part, keys) for part in figures["parts"]]}


def _short_mutants(figures: Facts) -> Facts:
    return {name: value for name, value in figures.items() if name != "mutants"}


def _short_fuzz(figures: Facts) -> Facts:
    return {**figures, "machines": [
        {**one, "times": {key: value for key, value in one["times"].items() if key != "measured"}}
        if "times" in one else one for one in figures["machines"]]}


def _short_flips(figures: Facts) -> Facts:
    left_out = ("registers", "silent_ones")
    return {**figures, "machines": [
        {key: value for key, value in one.items() if key not in left_out}
        for one in figures["machines"]]}


def _short_resets(figures: Facts) -> Facts:
    return {**figures, "machines": [{**one, "wrong": one["wrong"][:10]}
                                    for one in figures["machines"]]}


def _short_coverage(figures: Facts) -> Facts:
    facts = {}
    if "lines" in figures:
        facts["lines"] = {key: value for key, value in figures["lines"].items() if key != "never"}
    if "states" not in figures:
        return facts
    states = facts["states"] = {}
    for name in _in_order(point["component"] for point in figures["states"]):
        own = [point for point in figures["states"] if point["component"] == name]
        states[name] = {
            **{kind: _found([point for point in own if point["kind"] == kind])
               for kind in ("state", "transition")},
            "last": max(point["clock"] or 0 for point in own)}
    return facts


def _short_arcs(figures: Facts) -> Facts:
    """Keep of what each arc has come to the median, that of 99 of 100, and the most."""
    def parts(values: Sequence[float]) -> list[float]:
        ordered = sorted(values)
        return [float(f"{ordered[round(part * (len(ordered) - 1))]:.4g}")
                for part in (0.5, 0.99, 1)]

    return {setting: {name: parts(value) if isinstance(value, list) else value
                      for name, value in one.items()} for setting, one in figures.items()}


def _short_build(figures: Facts) -> Facts:
    return _only(figures, ("machine", "board", "guard", "orders", "ramp_steps_per_s2", "resources",
                           "capacity"))


_SHORTER: Mapping[str, Callable[[Facts], Facts]] = {
    "proofs": _short_proofs, "kills": _short_kills, "vhdl": _short_vhdl,
    "netlist": _short_netlist,
    "resets": _short_resets, "flips": _short_flips, "mutants": _short_mutants,
    "arcs": _short_arcs, "fuzz": _short_fuzz, "coverage": _short_coverage, "size": _short_build,
}

# Words and tables


def _only(facts: Facts, keys: Iterable[str]) -> dict:
    short = {key: facts[key] for key in keys if key in facts}
    return {key: round(value, 2) if isinstance(value, float) else value
            for key, value in short.items()}


def _table(head: Sequence[str], rows: Iterable[Sequence]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(_cell(cell) for cell in line)} |\n" for line in lines)


def _cell(value: object) -> str:
    return str(value).replace("|", "\\|").replace("\n", " ")


def _many(number: int) -> str:
    return f"{number:,}".replace(",", " ")


def _seconds(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 600 else f"{seconds / 60:.0f} min"


def _resumed(part: Facts) -> str:
    return ", besides what was known from a run before" if part["resumed"] else ""


def _struck(facts: Facts) -> str:
    """Name a machine, and whether it has its guard, if it can have one."""
    guard = {None: "", True: " with guard", False: " without guard"}[facts.get("guard")]
    return f"{facts['machine']}{guard}"


def _proved(proofs: Sequence[Facts]) -> int:
    return sum(proof["verdict"] == "proved" for proof in proofs)


def _found(sought: Sequence[Facts]) -> str:
    """Return how many of those were found, which have a clock then."""
    return f"{sum(one['clock'] is not None for one in sought)} of {len(sought)}" if sought else "-"


def _and(words: Iterable[str]) -> str:
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last


def _in_order(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))
