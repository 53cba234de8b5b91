"""Boards that the machines run on: pins as data, and each machine wired to them."""
