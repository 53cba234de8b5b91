"""A campaign of cosimulation: many random clocks, in chunks for all cores, resumable.

Each chunk starts at power-up and has random blocks of its own, so that any process can run it at
any time. The state is a JSON file, replaced atomically after every chunk.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import asdict, dataclass, field
from pathlib import Path

from tb.cosim import Finding, lockstep
from tb.engines import ENGINES, source
from tb.registry import duts
from tb.runners import close_all, make_runners
from tb.stimulus import BLOCK, Stimulus, random_blocks

from .console import UserError, write_atomically
from .processes import pool

__all__ = ["CHUNK", "Campaign", "Plan", "chunk_blocks", "load", "run"]

#: Clocks of a chunk.
CHUNK = 64 * BLOCK


@dataclass(frozen=True)
class Plan:
    """The parameters of a campaign. Campaigns with equal plans are the same.

    Attributes
    ----------
    machine : str
        Name of the machine.
    engines : tuple of str
        Names of the engines.
    seed : int
        Seed of the stimulus.
    clocks : int
        Total number of clocks.
    gateware : str
        Fingerprint of the machine's design.
    """

    machine: str
    engines: tuple[str, ...]
    seed: int
    clocks: int
    gateware: str

    @classmethod
    def of(cls, machine: str, engines: Sequence[str], seed: int, clocks: int) -> "Plan":
        """Make the plan of a machine as it is now."""
        text = source.rtlil(duts()[machine].shared)
        return cls(machine, tuple(engines), seed, clocks, hashlib.sha256(text.encode()).hexdigest())

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return -(-self.clocks // CHUNK)

    def size(self, chunk: int) -> int:
        """Clocks of a chunk; the last may be shorter."""
        return min(CHUNK, self.clocks - chunk * CHUNK)


@dataclass
class Campaign:
    """A plan, and its progress.

    Attributes
    ----------
    plan : Plan
        The plan.
    done : dict of int to (str, dict)
        Checksum, and seconds by engine, of the chunks that are done.
    failed : (int, Finding), optional
        A chunk with a difference. It is not counted as done.
    """

    plan: Plan
    done: dict[int, tuple[str, dict[str, float]]] = field(default_factory=dict)
    failed: tuple[int, Finding] | None = None

    @property
    def clocks(self) -> int:
        """Clocks that are done."""
        return sum(self.plan.size(chunk) for chunk in self.done)

    @property
    def checksum(self) -> str:
        """Hash of the checksums of all chunks, in order."""
        every = "".join(self.done[chunk][0] for chunk in sorted(self.done))
        return hashlib.sha256(every.encode()).hexdigest()[:16]

    def seconds(self, engine: str) -> float:
        """Seconds that an engine took so far."""
        return sum(times[engine] for _, times in self.done.values())

    def save(self, path: Path) -> None:
        """Write the state atomically."""
        done = {str(chunk): self.done[chunk] for chunk in sorted(self.done)}
        state = {"plan": asdict(self.plan), "done": done}
        write_atomically(path, (json.dumps(state, indent=1) + "\n").encode())


def load(path: Path, plan: Plan) -> Campaign:
    """Resume a campaign, or begin it if the file does not exist.

    Raises
    ------
    UserError
        If the file is not the state of a campaign, or of another one.
    """
    if not path.exists():
        return Campaign(plan)
    try:
        state = json.loads(path.read_bytes())
        saved = Plan(**{**state["plan"], "engines": tuple(state["plan"]["engines"])})
        done = {int(n): (str(total), dict(times)) for n, (total, times) in state["done"].items()}
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise UserError(f"{path} is not the state of a campaign") from error
    other = [name for name, value in asdict(plan).items() if asdict(saved)[name] != value]
    if other:
        raise UserError(f"{path} is of another campaign (other {', '.join(other)}): "
                        "give another --state, or delete it")
    return Campaign(plan, done)


def chunk_blocks(plan: Plan, chunk: int) -> Iterator[Stimulus]:
    """Return the stimulus of a chunk."""
    return random_blocks(duts()[plan.machine].random, plan.seed, plan.size(chunk),
                         first=chunk * (CHUNK // BLOCK))


def run(campaign: Campaign, path: Path, jobs: int, advance: Callable[[int], object]) -> None:
    """Run the remaining chunks until one differs; save after each."""
    plan = campaign.plan
    left = iter([chunk for chunk in range(plan.chunks) if chunk not in campaign.done])
    with pool(jobs) as workers:
        running: dict[Future, int] = {}
        while True:
            while len(running) < jobs and (chunk := next(left, None)) is not None:
                running[workers.submit(_run_chunk, plan, chunk)] = chunk
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                chunk = running.pop(future)
                total, times, finding = future.result()
                if finding is not None:
                    campaign.failed = chunk, finding
                    return
                campaign.done[chunk] = total, times
                campaign.save(path)
                advance(plan.size(chunk))


def _run_chunk(plan: Plan, chunk: int) -> tuple[str, dict[str, float], Finding | None]:
    dut = duts()[plan.machine]
    runners = make_runners(dut, plan.engines, ENGINES)
    try:
        outputs = list(dut.shared.outputs)
        outcome = lockstep(runners, chunk_blocks(plan, chunk), outputs)
    finally:
        close_all(runners)
    times = {name: round(tally.seconds, 3) for name, tally in outcome.tallies.items()}
    return f"{outcome.checksum:016x}", times, outcome.finding
