"""Kernels: scalar functions compiled by numba, or run as plain Python with the same bits."""
