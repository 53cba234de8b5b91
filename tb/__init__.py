"""Running and checking gateware: engines, models, the plant, benches, proofs, mutants, faults.

Each module and package says in its first line what it is; their order, and so what each may import,
is in tests/test_layout.py. `python -m tb` lists the benches.
"""
