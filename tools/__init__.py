"""Commands for people. `python -m tools` lists them."""
