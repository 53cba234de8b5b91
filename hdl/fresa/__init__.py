"""A numerical controller in gateware: motion-control components, and machines built from them."""
