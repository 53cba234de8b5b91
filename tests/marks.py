"""Marks of tests that need more than Python, with the reason why one is left out."""

import pytest

from tb.contracts.proof import missing

__all__ = ["needs_prover"]


def needs_prover(test):
    """Mark what needs z3."""
    return pytest.mark.prover(
        pytest.mark.skipif(missing() is not None, reason=str(missing()))(test))
