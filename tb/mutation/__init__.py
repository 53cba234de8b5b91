"""Mutants of the components, and what their benches and their contracts do with them."""

from .judge import Verdict
from .netlist import Mutant, MutationError
from .trial import Measure, Trial, begin, judge, measure, with_a_bench

__all__ = [
    "Measure", "Mutant", "MutationError", "Trial", "Verdict", "begin", "judge", "measure",
    "with_a_bench",
]
