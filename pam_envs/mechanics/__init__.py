"""Loads and joints, with steps that stay exact where the motion is stiff."""
