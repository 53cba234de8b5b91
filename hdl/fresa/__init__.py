"""A numerical controller in gateware: motion-control components and the machines built from them."""
