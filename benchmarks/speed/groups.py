"""Groups of probes, measured one after the other."""

from collections.abc import Callable, Sequence

from benchmarks.speed import probes
from benchmarks.speed.controllers import controllers
from benchmarks.speed.diagnosis import diagnosing
from benchmarks.speed.gpu import gpu
from benchmarks.speed.learning import learning, shares
from benchmarks.speed.rates import Measurement, Missing

Probe = Callable[[int], list[Measurement]]  # takes the number of rounds
Start = Callable[[int], Callable[[], None]]
"""Takes the number of groups and returns a function to call after each."""

GROUPS: dict[str, tuple[Probe, ...]] = {
    "single": (probes.single, probes.single_joints),
    "batch": (probes.batch, probes.variants, probes.growth, probes.cores, probes.processes),
    "air": (probes.airs,),
    "planning": (probes.planning,),
    "controllers": (controllers,),
    "plain": (probes.uncompiled,),
    "start": (probes.start_up,),
    "learning": (learning, shares),
    "diagnosis": (diagnosing,),
    "gpu": (gpu,),
}


def measure(
    only: Sequence[str] = (), rounds: int = 7, start: Start = lambda total: lambda: None
) -> list[Measurement]:
    """Measure the named groups, or all; a ValueError names an unknown one."""
    unknown = sorted(set(only) - set(GROUPS))
    if unknown:
        raise ValueError(f"no group named {unknown[0]!r}; there are: {', '.join(GROUPS)}")
    chosen = [name for name in GROUPS if not only or name in only]
    advance, results = start(len(chosen)), list[Measurement]()
    for name in chosen:
        for probe in GROUPS[name]:
            results += attempt(name, probe, rounds)
        advance()
    return results


def attempt(group: str, probe: Probe, rounds: int) -> list[Measurement]:
    """Return the measurements of a probe, or one line with the reason why there are none."""
    try:
        return probe(rounds)
    except Missing as reason:
        note = str(reason)
    except ModuleNotFoundError as error:
        note = f"{error.name} is not installed"
    except Exception as error:  # a failed figure must not prevent the others
        note = f"failed: {type(error).__name__}: {error}"
    title = (probe.__doc__ or probe.__name__).splitlines()[0].rstrip(".")
    return [Measurement(group, title, None, "", note=note)]
