"""Export of trained models as policy files."""
