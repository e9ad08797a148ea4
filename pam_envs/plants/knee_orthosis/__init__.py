"""Knee orthosis with one McKibben muscle."""
