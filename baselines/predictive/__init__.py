"""Predictive controllers: optimisation over a preview horizon."""
