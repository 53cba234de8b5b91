"""Waveforms read, asked, measured, compared and drawn; `python -m tools.wave` is the command."""
