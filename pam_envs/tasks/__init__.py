"""Tasks: named reward terms, costs and ends. No physics."""
