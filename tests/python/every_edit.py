"""Edits of every kind that passes tell apart, one after the other, and what they change."""


def node_with(objects, kind, index):
    return next(o["id"] for o in objects if o["kind"] == "node" and o["node"][kind] == index)


def material(**fields):
    """Of all materials: some is lit, some reflects light, some is seen."""
    def change(edit, objects):
        for id in {o["id"] for o in objects if o["kind"] == "material"}:
            edit.set_material(id, **fields)
    return change


def moved(kind, index, to):
    return lambda edit, objects: edit.set_transform(node_with(objects, kind, index), translation=to)


def light_added(edit, objects):
    edit.add_node(light=edit.add_light(kind="point", intensity=3), translation=(0, 1.5, 0))


# Of a scene with two lights, a camera and materials that are seen and lit. Names are those of the table in
# server/frame/README.md.
EDITS = {
    "light's power": lambda edit, objects: edit.set_light(0, intensity=7),
    "light moved": moved("light", 0, (.2, 1.1, .3)),
    "other light moved": moved("light", 1, (.1, 1.2, .2)),
    "roughness": material(roughness=.7),
    "roughness, glossy": material(roughness=.25),
    "metalness": material(metallic=.5),
    "colour": material(base_color=(.2, .5, .7, 1)),
    "emission": material(emissive=(.1, .2, .3)),
    "refraction": material(ior=1.8),
    "sides": material(double_sided=True),
    "unlit": material(unlit=True),
    "lit again": material(unlit=False),
    "alpha": material(alpha_mode="mask", alpha_cutoff=.5),
    "environment": lambda edit, objects: edit.set_environment(radiance=(.1, .1, .1)),
    "sky turned": lambda edit, objects: edit.set_environment(rotation=(0, .6, 0, .8)),
    "object moved": moved("mesh", 0, (0, .01, 0)),
    "camera moved": moved("camera", 0, (0, 1, 3)),
    "light added": light_added,
    "nothing seen": lambda edit, objects: edit.add_material(name="spare"),
}
