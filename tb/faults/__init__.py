"""Fault injection: resets at any time, and bit upsets of flip-flops."""
