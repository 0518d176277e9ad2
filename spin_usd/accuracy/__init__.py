"""Cost and error of settings: the formulas, the Pareto front, and the choice on it."""
