"""The pins that machines have on boards: a module BOARD_MACHINE for each pair.

They are committed: somebody's machine is wired by them. A change of one breaks a test.
"""
