"""Catalogue, entries, knobs and the policy-predictor protocol of controllers."""
