"""What a figure is made of: frames as data, lines to draw, ratios to compare."""
import dataclasses

COMMON = {"brdf": "lambert"}  # the papers of blocks and trees are about diffuse light; not the reference's, which is of all light
# The papers' blocks, down to the pixel and by what the camera sees alone, for all techniques that
# light blocks: what is compared has the same fragments. Splatting knows no threshold of light.
BY_CAMERA = {"depth_test": "minmax", "depth_threshold": .05, "finest": 1}
BY_CAMERA_ALONE = {**BY_CAMERA, "light_threshold": "inf"}
PAPERS_BLOCKS = {"multires_splat": BY_CAMERA, "multires_gather": BY_CAMERA_ALONE,
                 "isr": BY_CAMERA_ALONE, "hisr": BY_CAMERA_ALONE}


@dataclasses.dataclass(frozen=True)
class Run:
    """A frame to be measured. `against` names runs of the same group: the errors of this one's
    indirect light are taken against theirs."""
    label: str        # in its group: what figures find it by
    scene: object     # scenes.Scene
    technique: str
    settings: dict
    size: int         # pixels along each side
    camera: str = None
    against: tuple = ()
    timed: bool = True  # False: its first frame's time will do, for what is long or only a picture
    aa: int = 1         # sub-frames
    film: tuple = ()    # scenes of its frames, `scene` the first, where something moves: not timed
    moves_as: str = ""  # of a film, a run of the same film by the reference: how light moves in truth

    @property
    def scenes(self):
        return self.film or (self.scene,)

    @property
    def all_settings(self):
        own = {**PAPERS_BLOCKS.get(self.technique, {}), **self.settings}
        common = {} if self.technique == "reference" else COMMON
        return {**common, **{key: str(value) for key, value in own.items()}}


@dataclasses.dataclass(frozen=True)
class Group:
    """Frames that take turns, so that what slows the machine down for a while slows all of them:
    ratios are formed within a group. It is measured as a whole or not at all."""
    name: str
    runs: tuple
    needs: tuple = ()  # (technique, parameter) that this build may lack: then the group is skipped

    def __post_init__(self):
        labels = [run.label for run in self.runs]
        assert len(set(labels)) == len(labels), f"{self.name}: two runs of one label"
        others = {a for run in self.runs for a in (*run.against, run.moves_as) if a}
        assert others <= set(labels), self.name


@dataclasses.dataclass(frozen=True)
class Target:
    """One ratio of the paper beside ours. Without `least` and `most` nothing was asked for."""
    id: str           # algorithms.md B1.x to B5.x, or a word
    what: str
    ours: float
    paper: object = None  # a number, or a text where the paper has no number
    least: float = None
    most: float = None
    percent: bool = False  # shares and errors; else ratios

    @property
    def met(self):
        """None where nothing was asked for."""
        if self.least is None and self.most is None:
            return None
        return ((self.least is None or self.ours >= self.least)
                and (self.most is None or self.ours <= self.most))


@dataclasses.dataclass(frozen=True)
class Line:
    label: str
    points: tuple      # (x, y); a point whose y is None is left out
    paper: bool = False  # dashed and grey: the paper's own, as a ratio


@dataclasses.dataclass(frozen=True)
class Panel:
    title: str
    x: str             # what is along the axis, with its unit
    y: str
    lines: tuple
    log_x: bool = False
    log_y: bool = False
    percent_y: bool = False
    names: tuple = ()  # of the places 0, 1, ... on x, where they are things and not numbers


@dataclasses.dataclass(frozen=True)
class Figure:
    """`groups()` is the plan. The others take what was measured: {group: {label: point}}, with the
    groups that are missing left out, and must do with what is there."""
    name: str
    title: str         # with the paper's number of it
    says: str          # what the paper found
    groups: object
    panels: object
    targets: object = lambda found: []
    curves: tuple = ()  # ids that want a sentence whatever was measured


# --- reading points ---------------------------------------------------------------------------

# What a frame does for direct light and for its pixels, whatever the technique.
DIRECT = ("gbuffer", "shadow_map", "direct", "composite", "readback")


def frame_ms(point):
    return point["time_ms"]["frame"]["median"]


def passes_ms(point, *names):
    passes = point["time_ms"]["passes"]
    return sum(passes[name]["median"] for name in names if name in passes)


def indirect_ms(point):
    """All passes but those of direct light: maps of the light, VPLs, blocks, interpolation."""
    passes = point["time_ms"]["passes"]
    return sum(time["median"] for name, time in passes.items() if name not in DIRECT)


def stage_ms(point):
    """The stage that lights: gathering or splatting alone."""
    return passes_ms(point, "gather", "splat")


def fragments_share(point):
    return point["counts"]["fragments"] / (point["size"] * point["size"])


def error(point, against, kind="rel_rmse"):
    return point["error"][against][kind]


def flicker(point):
    """How far a film's pictures change from frame to frame as the light in truth does not, over the mean."""
    return point["motion"]["value"]


def along(found, stop, count, label, value):
    """Of groups "`stop` 0", "`stop` 1", ... that were measured: (number, value of the run `label`)."""
    return tuple((i, value(found[f"{stop} {i}"][label])) for i in range(count)
                 if f"{stop} {i}" in found)


def most_over_least(line):
    values = [y for _, y in line]
    return max(values) / min(values)


def each(found, names):
    """(name, its points) of those groups that were measured."""
    return [(name, found[name]) for name in names if name in found]
