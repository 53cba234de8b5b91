"""Faults from outside: resets at any time, and flip-flops that change by themselves."""
