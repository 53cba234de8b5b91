"""Measurements of speed, made side by side. Run one with `python -m benchmarks.NAME`."""
