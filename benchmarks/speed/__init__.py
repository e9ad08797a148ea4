"""Speed of environments, training, planning and diagnosis."""
