"""A numerical controller in gateware: motion-control components, and machines built from them.

Each package imports those before it alone: `drive`, `protocol` (whose times are counted by the
dividers of `drive`), `motion`, `panel`, `machines`.
"""
