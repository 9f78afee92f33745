"""Who is measured: every registered technique, and what users hold them against.

`auto` chooses for budgets of time and by its own estimate; `reference+filter` is the reference behind the
filter of noise; `cycles`, where Blender is installed, is another renderer on the same processor, and
`cycles+filter` the same behind the same filter.
"""
import dataclasses

from .. import techniques
from . import cycles

FILTER = {"noise_filter": "on"}
AUTO_BUDGETS_MS = (100, 300, 1000, 3000)
CYCLES_SPP = (4, 16, 64, 256)  # of two halves


@dataclasses.dataclass(frozen=True)
class Contestant:
    name: str                         # on the page, and on the command line
    summary: str
    technique: techniques.Technique   # that decides which settings it reads
    asked: str                        # what the daemon is asked for; "" for another renderer
    ladder: tuple
    has_own_model: bool               # of the rendering equation; without, the whole is its model
    settings: dict = dataclasses.field(default_factory=dict)  # at every rung
    is_unbiased: bool = False         # its error falls with the square root of time
    keeps_nothing: bool = False       # of one frame for the next
    is_filtered: bool = False         # another renderer's, by the reference's filter

    def has(self, key):
        return self.technique.has(key) if self.asked else key in cycles.SETTINGS


def _registered(technique):
    return Contestant(technique.name, technique.summary, technique, technique.name,
                      technique.ladder or ({},), not technique.is_reference,
                      is_unbiased=technique.is_reference, keeps_nothing=technique.is_reference)


def _beside(known):
    """`known` techniques are followed by these."""
    default = next((t for t in known if t.is_default), None)
    reference = next((t for t in known if t.is_reference), None)
    if default:
        budgets = tuple({"budget_ms": str(ms)} for ms in AUTO_BUDGETS_MS)
        yield Contestant("auto", "what is asked for when nothing is said", default, "auto",
                         ({}, *budgets), False)
    if not reference:
        return
    yield Contestant("reference+filter", "the reference behind the filter of noise", reference,
                     reference.name, reference.ladder or ({},), False, FILTER, keeps_nothing=True)
    found = cycles.version()
    rungs = tuple({"spp": str(spp)} for spp in CYCLES_SPP)
    if found:
        yield Contestant("cycles", f"Blender {found}, on the processor", reference, "", rungs, False,
                         is_unbiased=True, keeps_nothing=True)
        yield Contestant("cycles+filter", "the same behind the reference's filter", reference, "", rungs,
                         False, keeps_nothing=True, is_filtered=True)


def chosen(daemon, names=()):
    """Those of `names`, or all; refuses a name that nobody has."""
    known = techniques.registered(daemon)
    everybody = [*map(_registered, known), *_beside(known)]
    missing = set(names) - {c.name for c in everybody}
    if missing:
        raise SystemExit(f"nobody of the name {', '.join(sorted(missing))}; there are "
                         + ", ".join(c.name for c in everybody))
    return [c for c in everybody if not names or c.name in names]
