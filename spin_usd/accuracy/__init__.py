"""What a setting costs and what its pictures are worth: formulas, the Pareto front, and the choice on it."""
