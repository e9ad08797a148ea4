"""Serial chain of joints and links: kinematics, dynamics, numpy and kernels."""
