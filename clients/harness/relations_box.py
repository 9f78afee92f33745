"""A light in a closed box lights nothing outside of it, not even by rounding."""
import numpy as np

from .daemon import RenderError
from .gltf import Writer
from .relations_measure import outlines
from .shapes import box, quad
from .verdicts import FAIL, Verdict, judged

BOX_COLOUR = (0.6, 0.7, 0.8)
PLACES = {"near": (0.0, 0.0, 0.0), "far away": (3.1e5, -2.2e5, 1.7e5)}


def scene(place, height):
    """A thin box, seen from both sides, on a floor that is lower by `height` m, all at `place`; in
    it a point light. Cameras: Outside, Inside."""
    w = Writer()
    shell = w.material("shell", BOX_COLOUR, doubleSided=True)
    root = w.node("Place", translation=list(place))
    walls = w.mesh("Box", *box((0.51, 0.43, 0.47))[:3], shell)
    w.node("Box", root, mesh=walls, translation=[0, 0.43, 0])
    ground = w.mesh("Floor", *quad((0, -height, 0), (3, 0, 0), (0, 0, -3))[:3],
                    w.material("ground", (0.3, 0.6, 0.2)))
    w.node("Floor", root, mesh=ground)
    for camera in (w.camera("Outside", (1.7, 1.6, 2.3), (-1.7, -1.3, -2.3), yfov=0.9),
                   w.camera("Inside", (0.4, 0.7, 0.4), (-1, -1.1, -0.9), yfov=1.2),
                   w.light("Lamp", "point", 50.0, (0.13, 0.52, -0.08))):
        w.doc["scenes"][0]["nodes"].remove(camera)
        w.doc["nodes"][root]["children"].append(camera)
    return w


def _outside_light(technique, frame):
    """Largest light that is there and should not be, over what the model knows.

    Outlines do not count: a rasteriser moves corners by up to 1/256 of a pixel, and past the top
    edge of a wall the pixel beyond sees the lit inner side of the one behind.

    Without visibility of indirect light, the floor may see virtual lights through the walls. The
    outer sides of the box may not: every virtual light lies in their plane or behind it. With a
    second bounce even those see what the floor sends back.
    """
    light = np.abs(frame.layer("direct").astype(np.float64)) + np.abs(frame.layer("emission"))
    model = technique.model
    indirect = np.abs(frame.layer("indirect").astype(np.float64))
    if model.indirect_visibility:
        light += indirect
    elif model.indirect_bounces <= 1:
        on_box = np.all(np.abs(frame.layer("albedo") - BOX_COLOUR) < 0.01, axis=-1)
        light += np.where(on_box[..., None], indirect, 0)
    return float(np.nan_to_num(light, nan=np.inf)[~outlines(frame)].max())


def closed_box(daemon, technique, options, reproduce):
    """Verdicts: nothing outside, and something inside, at two places and two floors."""
    layers = ("beauty", "direct", "indirect", "emission", "albedo", "depth")
    for name, place in PLACES.items():
        for height in (0.0, 0.3):
            path = (options.keep or daemon.folder) / f"closed_box.{name[:3]}.{height:g}.glb"
            path.parent.mkdir(parents=True, exist_ok=True)
            scene(place, height).write_glb(path)
            note = f"{name}, floor {height:g} m below"
            try:
                frame = daemon.render(path, technique.name, {}, options.size, "Outside", layers)
                inside = daemon.render(path, technique.name, {}, options.size, "Inside", layers)
            except RenderError as fault:
                yield Verdict(technique.name, "closed_box", "box", FAIL, note=str(fault),
                              command=fault.command)
                continue
            yield judged(technique.name, "closed_box", "box", _outside_light(technique, frame), 0,
                         f"light outside, {note}", reproduce)
            dark = float((inside.layer("direct").max(axis=-1) <= 0).mean())
            yield judged(technique.name, "closed_box", "box", dark, 0.01,
                         f"share of dark pixels inside, {note}", reproduce)
