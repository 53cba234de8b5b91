"""Commands for users. `python -m tools` lists them."""
