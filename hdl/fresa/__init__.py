"""A numerical controller in gateware: motion-control components, and machines built from them.

Each package knows those before it: `drive`, `protocol` (whose times are counted by the dividers of
`drive`), `motion`, `panel`, `machines`.
"""
