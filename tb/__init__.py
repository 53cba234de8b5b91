"""Running the gateware: engines, models, the plant, benches. `python -m tb` lists the benches."""
