"""From recordings to models: fits that say how much of them the data decide."""
