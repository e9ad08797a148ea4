"""Pictures of environments: canvas, camera, plots and films, without code of a family."""
