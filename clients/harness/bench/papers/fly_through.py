"""Nichols and Wyman 2010, Fig. 9: cost and number of subsplats along a camera's path, by the test that
finds discontinuities. Thresholds are such that the errors at the path's beginning are alike."""
from . import scenes
from .figure import (Figure, Group, Line, Panel, Run, Target, along, error, fragments_share, frame_ms,
                     most_over_least)

VPLS, SIZE = 64, 1024
DRAGON, BUNNY, ROOM = (-.15, .4, -.25), (.45, .3, .4), (0, .9, 0)  # what is looked at, metres
PATH = (((0, 1, 3.9), ROOM), ((.9, 1, 1.7), DRAGON), ((.6, .7, 1.1), DRAGON), ((.1, .5, .8), DRAGON),
        ((-.5, .6, .8), BUNNY), ((-.8, 1.2, .6), BUNNY))  # ((eye, what it looks at), ...)
TESTS = {
    "minmax depth, minmax normal": {"depth_test": "minmax", "depth_threshold": .05,
                                    "normal_test": "minmax", "normal_threshold": .25},
    "derivative, minmax normal": {"depth_test": "derivative", "depth_threshold": .02,
                                  "normal_test": "minmax", "normal_threshold": .25},
    "minmax depth, chord": {"depth_test": "minmax", "depth_threshold": .05,
                            "normal_test": "chord", "normal_threshold": .1},
    "derivative, chord": {"depth_test": "derivative", "depth_threshold": .02,
                          "normal_test": "chord", "normal_threshold": .1}}
FIRST = next(iter(TESTS))


def groups():
    scene = scenes.with_cameras(scenes.DRAGON, PATH)
    return [Group(f"camera {i}", tuple(_runs(scene, f"path{i}"))) for i in range(len(PATH))]


def _runs(scene, camera):
    yield Run("full", scene, "rsm", {"vpls": VPLS}, SIZE, camera, timed=False)
    for name, test in TESTS.items():
        yield Run(name, scene, "multires_splat", {"vpls": VPLS, "surface_detail": "off", **test},
                  SIZE, camera, against=("full",))


def panels(found):
    place = "camera along the path"
    first = next(iter(found.values()))[FIRST]
    return [Panel("Frame", place, "time over the first test’s at the start",
                  _lines(found, lambda p: frame_ms(p) / frame_ms(first))),
            Panel("Subsplats for each VPL", place, "share of the pixels",
                  _lines(found, fragments_share), percent_y=True),
            Panel("Error", place, "relative RMSE without the worst .01 %",
                  _lines(found, lambda p: error(p, "full", "trimmed")), percent_y=True)]


def _lines(found, value):
    return tuple(Line(test, _along(found, test, value)) for test in TESTS)


def _along(found, test, value):
    return along(found, "camera", len(PATH), test, value)


def _mean_ratio(found, test, other):
    ratios = [frame_ms(points[test]) / frame_ms(points[other]) for points in found.values()]
    return sum(ratios) / len(ratios)


def targets(found):
    if not found:
        return []
    made = []
    for test in TESTS:
        made.append(Target("B1.7", f"most over fewest subsplats along the path: {test}",
                           most_over_least(_along(found, test, fragments_share)), "up to 3", most=3.0))
    slower = (("derivative, minmax normal", "derivative over minmax of depth"),
              ("minmax depth, chord", "chord over minmax of normals"))
    made += [Target("B1.9", f"frame, {what}, mean of the path", _mean_ratio(found, test, FIRST),
                    "slower", least=1.0) for test, what in slower]
    return made


FIGURE = Figure(
    "fly_through", "Cost along a camera’s path (Nichols and Wyman 2010, Fig. 9)",
    "The four tests cost much the same at similar quality; derivatives of depth are slightly slower, "
    "curvature needs a low threshold; the number of subsplats varies by up to 300 % along the path, and "
    "the frame with it.",
    groups, panels, targets)
