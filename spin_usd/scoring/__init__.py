"""How good predicted poses are: the formulas of scores and errors."""
