"""Reinforcement learning: presets, training, hyper-parameter search, policies as ONNX files."""
