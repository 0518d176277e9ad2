"""Simple targets that stand in for spacecraft of published sets whose models are not free."""
