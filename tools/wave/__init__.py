"""Waveforms: read, searched, measured, compared, drawn; `python -m tools.wave` is the command."""
