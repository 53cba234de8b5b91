"""Mutants of the components, and which of their benches and contracts kill them."""

from .judge import Verdict
from .netlist import Mutant, MutationError
from .trial import Measure, Trial, begin, judge, measure, with_a_bench

__all__ = [
    "Measure", "Mutant", "MutationError", "Trial", "Verdict", "begin", "judge", "measure",
    "with_a_bench",
]
