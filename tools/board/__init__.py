"""The Nexys 2 and its machine on a page, with the gateware running behind it."""
