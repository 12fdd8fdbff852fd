"""Parts of `reproduce_tables.py` and `reproduce_seed001.py`: the papers' simulations, run again."""
