"""Runs inside Blender: a glTF file through Cycles, a picture for each shot of a job.

blender -b --factory-startup -P cycles_in_blender.py -- JOB.json

Light is meant as glTF's: punctual lights have no size and KHR_lights_punctual's falloff, nothing is clamped, and
`lambert` makes every material a diffuse one of its colour, emission and alpha.
"""
import json
import math
import sys
import time

import bpy
import numpy

if "bool" not in vars(numpy):
    numpy.bool = bool  # the importer of 3.4 is older than the numpy that Debian gives it

BOUNCES = 64


def import_scene(job):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=job["scene"], convert_lighting_mode="COMPAT")
    return bpy.context.scene


def camera_of(scene, job):
    cameras = sorted((o for o in scene.objects if o.type == "CAMERA"), key=lambda o: o.name != job["camera"])
    camera = cameras[0]
    camera.data.sensor_fit = "VERTICAL"
    camera.data.angle_y = job["yfov"]
    return camera


def set_up(scene, job):
    scene.camera = camera_of(scene, job)
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = job["size"]
    render.resolution_percentage = 100
    render.use_persistent_data = True
    render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "ZIP"
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "GAUSSIAN"
    cycles.filter_width = 0.01  # through the pixel's centre; a box is a pixel wide, whatever is said
    for bound in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "transparent_max_bounces"):
        setattr(cycles, bound, BOUNCES)
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    scene.world = bpy.data.worlds.new("none")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
    layer = scene.view_layers[0]
    for kind in ("diffuse", "glossy", "transmission"):
        for part in ("direct", "indirect", "color"):
            setattr(layer, f"use_pass_{kind}_{part}", True)
    layer.use_pass_emit = True


def light_as_khr(light):
    """Of no size; a spot's edge is (a - cos outer)^2 / (cos inner - cos outer)^2."""
    light.shadow_soft_size = 0
    light.cycles.max_bounces = 1024
    if light.type == "SUN":
        light.angle = 0
    if light.type != "SPOT":
        return
    outer = light.spot_size / 2
    inner = outer * (1 - light.spot_blend)
    low, high = math.cos(outer), math.cos(inner)
    light.spot_blend = 0
    light.use_nodes = True
    nodes, links = light.node_tree.nodes, light.node_tree.links
    emission = nodes["Emission"]

    def math_node(operation, a, b, clamp=False):
        node = nodes.new("ShaderNodeMath")
        node.operation, node.use_clamp = operation, clamp
        for socket, value in zip(node.inputs, (a, b)):
            if isinstance(value, float):
                socket.default_value = value
            else:
                links.new(value, socket)
        return node.outputs[0]

    apart = nodes.new("ShaderNodeSeparateXYZ")
    links.new(nodes.new("ShaderNodeTexCoord").outputs["Normal"], apart.inputs[0])
    along = math_node("ABSOLUTE", apart.outputs["Z"], 0.0)
    part = math_node("DIVIDE", math_node("SUBTRACT", along, low), max(high - low, 1e-4), True)
    # Its own spots fall off with the cosine beside their edge.
    links.new(math_node("DIVIDE", math_node("MULTIPLY", part, part), along), emission.inputs["Strength"])


def principled_of(material):
    nodes = material.node_tree.nodes if material.use_nodes else ()
    return next((n for n in nodes if n.type == "BSDF_PRINCIPLED"), None)


def shine_in_front(material):
    """What has one side shines from that alone; it still hides what is behind it."""
    principled = principled_of(material)
    if not (principled and material.use_backface_culling):
        return
    nodes, links = material.node_tree.nodes, material.node_tree.links
    strength = principled.inputs["Emission Strength"]
    front = nodes.new("ShaderNodeMath")
    front.operation = "SUBTRACT"
    front.inputs[0].default_value = 1
    links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], front.inputs[1])
    product = nodes.new("ShaderNodeMath")
    product.operation = "MULTIPLY"
    links.new(front.outputs[0], product.inputs[0])
    take(material, strength, product.inputs[1])
    links.new(product.outputs[0], strength)


def take(material, source, socket):
    """A socket's link or value for another one."""
    if source.is_linked:
        material.node_tree.links.new(source.links[0].from_socket, socket)
    else:
        socket.default_value = source.default_value


def as_lambert(material):
    old = principled_of(material)
    out = next((n for n in material.node_tree.nodes if n.type == "OUTPUT_MATERIAL"), None) if old else None
    if not out:
        return
    nodes, links = material.node_tree.nodes, material.node_tree.links
    diffuse, glow, both = map(nodes.new, ("ShaderNodeBsdfDiffuse", "ShaderNodeEmission", "ShaderNodeAddShader"))
    take(material, old.inputs["Base Color"], diffuse.inputs["Color"])
    take(material, old.inputs["Emission"], glow.inputs["Color"])
    take(material, old.inputs["Emission Strength"], glow.inputs["Strength"])
    links.new(diffuse.outputs[0], both.inputs[0])
    links.new(glow.outputs[0], both.inputs[1])
    alpha = old.inputs["Alpha"]
    shader = both
    if alpha.is_linked or alpha.default_value < 1:
        shader, clear = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeBsdfTransparent")
        take(material, alpha, shader.inputs[0])
        links.new(clear.outputs[0], shader.inputs[1])
        links.new(both.outputs[0], shader.inputs[2])
    links.new(shader.outputs[0], out.inputs["Surface"])


def render(scene, shot):
    scene.cycles.samples = shot["spp"]
    scene.cycles.seed = shot["seed"]
    scene.render.filepath = shot["file"]
    start = time.monotonic()
    bpy.ops.render.render(write_still=True)
    return time.monotonic() - start


def main():
    with open(sys.argv[-1], encoding="utf-8") as file:
        job = json.load(file)
    scene = import_scene(job)
    set_up(scene, job)
    for light in bpy.data.lights:
        light_as_khr(light)
    for material in bpy.data.materials:
        shine_in_front(material)
        if job["lambert"]:
            as_lambert(material)
    render(scene, {**job["shots"][0], "spp": 1})
    for shot in job["shots"]:
        shot["s"] = render(scene, shot)
    with open(job["answer"], "w", encoding="utf-8") as file:
        json.dump({"version": bpy.app.version_string, "shots": job["shots"]}, file)


main()
