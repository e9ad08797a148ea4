"""Readers of log files: MATLAB, TDMS, HDF5, ROS 2 bags, and CSV with other columns."""
