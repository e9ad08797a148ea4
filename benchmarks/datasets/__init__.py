"""Data sets for offline learning and identification: behaviours, recording, metadata."""
