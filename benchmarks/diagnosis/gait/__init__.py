"""Diagnosis of the estimate of the knee torque during a gait."""
