"""Running the gateware: engines, models, the plant and the benches. `python -m tb` lists the benches."""
