"""Bit-exact models in plain Python, written from what the machines promise."""
