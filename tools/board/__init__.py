"""The page of the Nexys 2 and its machine; their gateware runs in a process of its own."""
