"""The TOML files: their tables, what is wrong with them, and the rooms' values made of them."""
