"""What displays show."""

__all__ = ["LIT"]

LIT = ("abcdef", "bc", "abdeg", "abcdg", "bcfg", "acdfg", "acdefg", "abc",
       "abcdefg", "abcdfg", "abcefg", "cdefg", "adef", "bcdeg", "adefg", "aefg")
"""Segments that are lit for each digit from 0 to F."""
