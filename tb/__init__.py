"""Running and checking gateware: engines, models, the plant, benches, proofs, mutants, faults.

The first line of each module and package describes it; their order, and so their allowed imports,
are in tests/test_layout.py. `python -m tb` lists the benches.
"""
