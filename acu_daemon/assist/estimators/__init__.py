"""The estimators: the three of the papers, and `full`.  Pure."""
