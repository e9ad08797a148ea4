"""Gymnasium environments: a plant, a reference and a task. One folder a family."""
