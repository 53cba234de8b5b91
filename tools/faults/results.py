"""Results of fault injection."""

from dataclasses import asdict, dataclass, field

import numpy as np
from numpy.typing import NDArray

from tb.faults.target import FaultTarget
from tb.faults.verdicts import Register, Silent, Verdict, WrongReset

__all__ = ["Upsets", "Resets"]


@dataclass
class Resets:
    """What came of resets of a machine."""

    machine: FaultTarget
    resets: int = 0
    clocks: int = 0
    steps: int = 0
    seconds: float = 0.0
    wrong: list[WrongReset] = field(default_factory=list)

    def facts(self) -> dict[str, object]:
        """List the figures, ready for JSON."""
        return {
            **_called(self.machine),
            "resets": self.resets,
            "clocks": self.clocks,
            "steps": self.steps,
            "seconds": self.seconds,
            "wrong": [asdict(wrong) for wrong in self.wrong],
        }


@dataclass
class Upsets:
    """What came of upsets of a machine: how often each verdict, register by register."""

    machine: FaultTarget
    registers: list[Register]
    verdicts: NDArray[np.int64]
    clocks: int = 0
    seconds: float = 0.0
    silent: list[Silent] = field(default_factory=list)

    @property
    def upsets(self) -> int:
        """Upsets."""
        return int(self.verdicts.sum())

    def count(self, verdict: Verdict) -> int:
        """Upsets that came to a verdict."""
        return int(self.verdicts[:, verdict].sum())

    def facts(self) -> dict[str, object]:
        """List the figures, ready for JSON."""
        return {
            **_called(self.machine),
            "flips": self.upsets,
            "flip_flops": sum(register.width for register in self.registers),
            "clocks_of_work": self.clocks,
            **{verdict.name.lower(): self.count(verdict) for verdict in Verdict},
            "silent_rate": self.count(Verdict.SILENT) / self.upsets,
            "seconds": round(self.seconds, 3),
            "flips_per_second": round(self.upsets / max(self.seconds, 1e-9)),
            "registers": {
                register.name: {"bits": register.width, **{
                    verdict.name.lower(): int(row[verdict]) for verdict in Verdict}}
                for register, row in zip(self.registers, self.verdicts, strict=True)},
            "silent_ones": [asdict(upset) for upset in self.silent],
        }


def _called(machine: FaultTarget) -> dict[str, object]:
    return {"machine": machine.name,
            **({} if machine.guard is None else {"guard": machine.guard})}
