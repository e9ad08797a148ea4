"""Figures of a diagnosis, as SVG elements for its page."""

from collections.abc import Mapping
from typing import Any

from pam_envs.diagnosis.figures.canvas import Picture, drawing
from pam_envs.diagnosis.figures.of_readings import Curves, cell_effects, cycles, left_over
from pam_envs.diagnosis.figures.of_report import isolability, kinds, rivals, structure
from pam_envs.diagnosis.figures.of_traces import effects, loops, replay, residual, scatter, zoom
from pam_envs.diagnosis.figures.quantities import View

__all__ = ["Picture", "draw"]

OF_TRACES = (replay, zoom, residual, scatter, loops, effects)
OF_READINGS = (cycles, left_over, cell_effects)
OF_REPORT = (structure, rivals, kinds, isolability)


def draw(report: Mapping[str, Any], traces: Any) -> dict[str, Picture]:
    """Draw the figures of a diagnosis, by name; ModuleNotFoundError without matplotlib."""
    view = None if traces is None else View.of(traces)
    with drawing():
        made = [f(report) for f in OF_REPORT]
        if view is not None and view.channels and len(view.clock) > 1:
            made += [f(report, view) for f in OF_TRACES]
        elif (report.get("readings") or {}).get("curves"):
            curves = Curves(report["readings"]["curves"])
            made += [f(report, curves) for f in OF_READINGS]
    return {picture.name: picture for picture in made if picture is not None}
