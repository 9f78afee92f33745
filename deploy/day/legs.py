"""The legs of a day on a GPU: what each runs, and for how long. `legs.py scenes` prints the scene
set's files that they need.

A leg has tests, whole suites of the build's, and benches, which are commands of their own. In words of
a command @SOURCE@, @BUILD@, @SCENES@ and @PYTHON@ are the bundle's places, @OUT@ is the leg's folder
of results.
"""
import dataclasses
import sys

# Nine minutes, less what an interrupted bench has to write and the packing of what there is.
LEG_SECONDS = 510

BOX, SPOT = "@SCENES@/scenes/cornell_box.glb", "@SCENES@/scenes/cornell_box_spot_side.glb"
SPONZA, GARDEN = "@SCENES@/scenes/sponza_dabrovic.glb", "@SCENES@/scenes/garden.glb"
BOUNCE = "@BUILD@/clients/cli/bounce"
BENCHES = "@SOURCE@/tests/bench"

# What tests and benches read of the scene set.
SCENES = ("cornell_box", "cornell_box_spot_side", "cornell_dragon_bunny", "garden", "sibenik",
          "sponza_dabrovic", "teapot_box")
REFERENCES = tuple(f"{scene}.lambert{kind}.{half}" for scene in
                   ("cornell_box", "cornell_box_spot_side", "sponza_dabrovic", "sibenik")
                   for kind in ("", ".point") for half in (1, 2))


@dataclasses.dataclass(frozen=True)
class Bench:
    """A command of its own. One that `goes_on` is interrupted when the leg's time is up, and keeps
    what it has until then; of another nothing is kept. `ends` are exit codes beside 0 that are no
    failure: bounce bench's 2 says that this machine draws no page, which `collect` does."""
    name: str
    words: tuple
    seconds: int  # about, on a data-centre GPU and 16 cores
    goes_on: bool = False
    ends: tuple = ()


@dataclasses.dataclass(frozen=True)
class Leg:
    what: str
    seconds: int  # about, as above
    suites: tuple = ()
    benches: tuple = ()
    environment: tuple = ()  # (name, value) for all of it


def _script(name, *words):
    return ("@PYTHON@", f"{BENCHES}/{name}.py", "@BUILD@", *words)


LEGS = {
    "device": Leg("what the device is and does: gpu, pass, rays, frame, analytic, e2e, cli; the daemon's fences", 330,
                  suites=("gpu", "pass", "rays", "frame", "analytic", "e2e", "cli"), benches=(
        Bench("sandbox", ("@PYTHON@", "@SOURCE@/deploy/day/sandbox.py", "@BUILD@/server/bounced", BOUNCE,
                          "@SOURCE@/tests/scenes/cornell.glb", "-o", "@OUT@/sandbox.json"), 60),
        Bench("ray_device.sponza", ("@BUILD@/tests/bench/ray_device", SPONZA, "2"), 10),
        Bench("ray_device.garden", ("@BUILD@/tests/bench/ray_device", GARDEN, "2"), 10))),
    "pictures": Leg("what pictures look like: golden, stability, matrix", 420,
                    suites=("golden", "stability", "matrix")),
    "bench": Leg("whole commands, slices, latency of edits, error against run time", LEG_SECONDS, benches=(
        Bench("first_light", _script("first_light", "-o", "@OUT@/first_light.json", "--runs", "5",
                                     "--scenes", "@SCENES@/scenes"), 60),
        Bench("slice_overhead.sponza", ("@BUILD@/tests/bench/slice_overhead", SPONZA, "7"), 15),
        Bench("slice_overhead.garden", ("@BUILD@/tests/bench/slice_overhead", GARDEN, "7"), 20),
        Bench("edit_latency", _script("edit_latency", "-o", "@OUT@/edit_latency.json", "--samples",
                                      "60", "--others", "10"), 90),
        Bench("bench", (BOUNCE, "bench", BOX, SPONZA, SPOT, GARDEN, "--size", "256x256", "--runs",
                        "7", "--reference-spp", "256", "--seed", "1", "-o", "@OUT@/bench"), 320,
              goes_on=True, ends=(2,)))),
    "papers": Leg("figures of the source papers, at their sizes", LEG_SECONDS, benches=(
        Bench("papers", (BOUNCE, "bench", "--figures", "all", "--scenes", "@SCENES@/scenes", "--runs", "2",
                         "-o", "@OUT@/papers"), LEG_SECONDS,
              goes_on=True, ends=(2,)),)),
}


def suites():
    """Of all legs, each once."""
    return dict.fromkeys(suite for leg in LEGS.values() for suite in leg.suites)


def programs():
    """Of the build, that benches start and no test depends on."""
    prefix = "@BUILD@/"
    return dict.fromkeys(word[len(prefix):] for leg in LEGS.values() for bench in leg.benches
                         for word in bench.words[:1] if word.startswith(prefix))


def scene_files():
    return ([f"scenes/{name}.glb" for name in SCENES]
            + [f"references/{name}.exr" for name in REFERENCES])


if __name__ == "__main__" and sys.argv[1:] == ["scenes"]:
    print("\n".join(scene_files()))
