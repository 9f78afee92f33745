"""What the registry says of each technique: `bounce techniques --json`.

Nothing in the harness names a technique: what applies to one follows from the model it declares.
"""
import dataclasses
import json
import subprocess

UNLIMITED = 0xFFFFFFFF


@dataclasses.dataclass(frozen=True)
class Model:
    """Its part of the rendering equation (server/technique/technique.h)."""
    indirect_bounces: int = 0
    indirect_visibility: bool = False
    lights: frozenset = frozenset()
    indirect_lights: frozenset = frozenset()  # of those, whose light surfaces send on
    glossy_receivers: bool = False
    glossy_senders: bool = False
    transmission: bool = False
    coverage: bool = False


@dataclasses.dataclass(frozen=True)
class Technique:
    name: str
    summary: str
    model: Model
    parameters: dict  # by key: the schema's Parameter
    ladder: tuple     # of settings, each a dict, from the cheapest to the best
    tolerance_direct: float
    tolerance_indirect: float
    hazard_codes: str
    is_reference: bool
    # Decided by chance: exact in the mean, with noise, which is measured from pixels that see one point
    # (hazards/case.py), or by the variance layer where it is the reference.
    is_sampled: bool
    is_default: bool = False  # what is rendered where nobody says
    for_comparison: bool = False  # judged on less, where all techniques are judged at once
    tolerance_settings: dict = dataclasses.field(default_factory=dict)  # what the tolerances ask for

    def has(self, key):
        return key in self.parameters


def settings_of(text):
    """ "vpls=64 rsm_size=128" as {"vpls": "64", "rsm_size": "128"} """
    return dict(word.split("=", 1) for word in text.split())


def _technique(item):
    model = {field.name: item.get("model", {})[field.name] for field in dataclasses.fields(Model)
             if field.name in item.get("model", {})}
    for field in {"lights", "indirect_lights"} & model.keys():
        model[field] = frozenset(model[field])
    return Technique(
        name=item["name"], summary=item.get("summary", ""), model=Model(**model),
        parameters={p["key"]: p for p in item.get("parameters", [])},
        ladder=tuple(settings_of(rung) for rung in item.get("ladder", [])),
        tolerance_direct=item.get("tolerance_direct", 0.0),
        tolerance_indirect=item.get("tolerance_indirect", 0.0),
        hazard_codes=item.get("hazard_codes", ""),
        is_reference=item.get("is_reference", False),
        is_default=item.get("is_default", False),
        is_sampled=item.get("is_sampled", False),
        for_comparison=item.get("for_comparison", False),
        tolerance_settings=settings_of(item.get("tolerance_settings", "")))


def parsed(text):
    """The JSON of the command as techniques, in the registry's order."""
    return [_technique(item) for item in json.loads(text)["techniques"]]


def registered(daemon):
    """Every technique that the daemon can render with."""
    words = [daemon.bounce, "techniques", "--json", "--server", daemon.url]
    result = subprocess.run(words, capture_output=True, text=True, timeout=60, env=daemon.env,
                            check=False)
    if result.returncode != 0:
        raise RuntimeError(f"bounce techniques: exit code {result.returncode}: {result.stderr}")
    return parsed(result.stdout)


def chosen(daemon, names=()):
    """Those of `names`, or all; refuses a name that is not registered."""
    known = registered(daemon)
    missing = set(names) - {technique.name for technique in known}
    if missing:
        raise SystemExit(f"no technique {', '.join(sorted(missing))}; there are "
                         + ", ".join(technique.name for technique in known))
    return [technique for technique in known if not names or technique.name in names]
