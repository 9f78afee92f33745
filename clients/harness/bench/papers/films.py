"""Nichols and Wyman 2010, Sec. 5.1, and Nichols, Shopf and Wyman 2009: what flickers while the light moves, by the number of
virtual lights, and by clusters of them beside a regular grid."""
from . import scenes
from .figure import Figure, Group, Line, Panel, Run, Target, each, flicker

SIZE, FRAMES = 128, 12
STEP_M = (.0035, 0.0, 0.0)  # of the light from frame to frame: a thousandth of the rooms' diagonal
SCENES = {"cornell_box_spot_side": scenes.BOX, "teapot_box": scenes.TEAPOT}
TRUTH = {"brdf": "lambert", "model_of": "rsm", "spp": 512}
COUNTS = (256, 1024)  # 16x16 and 32x32, which the paper has enough for simple scenes
REGULAR = 4096
CLUSTERED = ("isr", "hisr")
# The paper names no number: of a frame's light, what is hardly seen to come and go.
SMOOTH = .01


def groups():
    return [Group(name, tuple(_runs(scenes.with_light_that_moves(scene, STEP_M, FRAMES)))) for name, scene in SCENES.items()]


def _runs(film):
    def run(label, technique, settings, moves_as="truth"):
        return Run(label, film[0], technique, settings, SIZE, timed=False, film=film, moves_as=moves_as)

    yield run("truth", "reference", TRUTH, moves_as="")
    for count in COUNTS:
        yield run(f"{count} VPLs", "multires_splat", {"vpls": count, "surface_detail": "off"})
    yield run(f"{REGULAR} VPLs", "rsm", {"vpls": REGULAR})
    for technique in CLUSTERED:
        yield run(technique, technique, {})


LABELS = (*(f"{count} VPLs" for count in (*COUNTS, REGULAR)), *CLUSTERED)


def panels(found):
    films = each(found, SCENES)
    if not films:
        return []
    lines = [Line(label, tuple((i, flicker(points[label])) for i, (_, points) in enumerate(films))) for label in LABELS]
    true = Line("what is true moves by", tuple((i, points[LABELS[0]]["motion"]["true"]) for i, (_, points) in enumerate(films)),
                paper=True)
    return [Panel("From frame to frame, beside what is true", "", "RMS of steps over the mean", (*lines, true),
                  names=tuple(name for name, _ in films), percent_y=True)]


def targets(found):
    made = []
    for name, points in each(found, SCENES):
        for count in COUNTS:
            made.append(Target("B1.10", f"flicker of {count} VPLs: {name}", flicker(points[f"{count} VPLs"]), "smooth", most=SMOOTH,
                               percent=True))
        motion = points[f"{COUNTS[-1]} VPLs"]["motion"]
        made += [Target("B1.10", f"without the hundredth of the pixels that flickers most, {COUNTS[-1]} VPLs: {name}", motion["trimmed"], percent=True),
                 Target("B1.10", f"half of all pixels, from frame to frame, less than: {name}", motion["half"], percent=True),
                 Target("B1.10", f"what is true moves by: {name}", motion["true"], percent=True)]
    for name, points in each(found, SCENES):
        regular = flicker(points[f"{REGULAR} VPLs"])
        made.append(Target("B2.10", f"flicker of {REGULAR:,} regular VPLs: {name}", regular, percent=True))
        for technique in CLUSTERED:
            made.append(Target("B2.10", f"flicker of {technique} over that of {REGULAR:,} regular VPLs: {name}",
                               flicker(points[technique]) / regular if regular else 1.0, "less than 1", most=1.0))
    return made


FIGURE = Figure(
    "films", "A light that moves, frame by frame (Nichols and Wyman 2010, Sec. 5.1; Nichols, Shopf and Wyman 2009)",
    "In simple scenes 16x16 to 32x32 VPLs are enough for smooth animations; light from clusters is as steady as that of more than "
    "4,096 regular VPLs.",
    groups, panels, targets)
