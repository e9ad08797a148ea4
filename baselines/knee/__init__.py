"""Controllers of the knee orthosis."""
