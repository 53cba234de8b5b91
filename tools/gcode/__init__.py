"""Programs of G-code, run on the gateware: what was asked for, what the pins did, and a picture."""
