// Nodes, and the lights and cameras that they place.

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_reader.h"
#include "scene/model/object_fields.h"

static const double pi = 3.14159265358979323846;

// Numbers outside their row's range are repaired.
static float number_of(enum bd_object_kind kind, const char *field, double value,
                       uint32_t *repaired)
{
    return bd_field_clamped(bd_object_field(kind, field), value, repaired);
}

static void read_cone(const struct bd_gltf_light *in, struct bd_light *out, uint32_t *repaired)
{
    const double gap_min = 1e-5;
    *repaired += !(in->cone_outer > 0 && in->cone_outer <= 0.5 * pi + 1e-6);
    *repaired += !(in->cone_inner >= 0 && in->cone_inner < in->cone_outer);
    uint32_t ignored = 0;
    out->cone_outer = number_of(BD_OBJECT_LIGHT, "cone_outer", in->cone_outer, &ignored);
    double inner_max = (double)out->cone_outer - gap_min;
    out->cone_inner = (float)fmin(fmax(in->cone_inner, 0), inner_max);
}

static enum bd_light_kind light_kind_of(const char *type)
{
    const char *const *words = bd_object_field(BD_OBJECT_LIGHT, "kind")->words;
    for (int kind = 0; words[kind]; kind++)
        if (strcmp(words[kind], type) == 0) return (enum bd_light_kind)kind;
    return BD_LIGHT_POINT;
}

static void read_light(struct bd_gltf_reader *reader, const struct bd_gltf_light *in,
                       struct bd_light *out)
{
    uint32_t repaired = in->range < 0;
    bd_gltf_copy_name(out->name, in->name);
    out->kind = light_kind_of(in->type);
    for (int i = 0; i < 3; i++)
        out->color[i] = number_of(BD_OBJECT_LIGHT, "color", in->color[i], &repaired);
    out->intensity = number_of(BD_OBJECT_LIGHT, "intensity", in->intensity, &repaired);
    out->range_m = number_of(BD_OBJECT_LIGHT, "range", in->range, &repaired);
    if (out->kind == BD_LIGHT_SPOT) read_cone(in, out, &repaired);
    reader->repairs.repaired_lights += repaired > 0;
}

static void read_perspective(const struct bd_gltf_camera *in, struct bd_camera *out,
                             uint32_t *repaired)
{
    const double near_usual_m = 1e-3;
    out->yfov = number_of(BD_OBJECT_CAMERA, "yfov", in->yfov, repaired);
    out->near_m = number_of(BD_OBJECT_CAMERA, "near", in->near, repaired);
    if (out->near_m > 0) return;
    out->near_m = in->near > 0 ? FLT_MIN : (float)near_usual_m;
    ++*repaired;
}

// A negative magnification mirrors the picture in some tools; here its size is what counts.
static float magnification(double value, uint32_t *repaired)
{
    const double size = fabs(value);
    const bool usable = bd_field_takes(bd_object_field(BD_OBJECT_CAMERA, "xmag"), size);
    *repaired += !(value > 0) || !usable;
    return usable ? (float)size : 1.0f;
}

static void read_camera(struct bd_gltf_reader *reader, const struct bd_gltf_camera *in,
                        struct bd_camera *out)
{
    uint32_t repaired = 0;
    bd_gltf_copy_name(out->name, in->name);
    out->orthographic = in->orthographic;
    if (in->orthographic) {
        out->xmag = magnification(in->xmag, &repaired);
        out->ymag = magnification(in->ymag, &repaired);
        out->near_m = number_of(BD_OBJECT_CAMERA, "near", in->near, &repaired);
    } else {
        read_perspective(in, out, &repaired);
    }
    out->far_m = number_of(BD_OBJECT_CAMERA, "far", in->far, &repaired);
    if (out->far_m <= out->near_m) {
        out->far_m = INFINITY;
        repaired++;
    }
    reader->repairs.repaired_cameras += repaired > 0;
}

static bd_dmat4 matrix_of(struct bd_gltf_reader *reader, const struct bd_gltf_node *in)
{
    if (!in->has_matrix) {
        double length = sqrt(in->rotation[0] * in->rotation[0] + in->rotation[1] * in->rotation[1] +
                             in->rotation[2] * in->rotation[2] + in->rotation[3] * in->rotation[3]);
        reader->repairs.repaired_rotations += !(fabs(length - 1) < 1e-3);
        return bd_dmat4_from_trs(in->translation, in->rotation, in->scale);
    }
    bd_dmat4 m;
    memcpy(m.m, in->matrix, sizeof m.m);
    reader->repairs.non_affine_matrices +=
        m.m[3] != 0 || m.m[7] != 0 || m.m[11] != 0 || m.m[15] != 1;
    m.m[3] = m.m[7] = m.m[11] = 0;
    m.m[15] = 1;
    return m;
}

static enum bd_err adopt_children(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_document *doc = reader->doc;
    struct bd_scene *scene = reader->scene;
    for (uint32_t i = 0; i < doc->node_count; i++)
        for (uint32_t c = 0; c < doc->nodes[i].child_count; c++) {
            struct bd_node *child = &scene->nodes[doc->nodes[i].children[c]];
            if (child->parent != BD_NONE)
                return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                                  bd_gltf_path("nodes[%u].children[%u]", i, c).text,
                                  "node %d has a parent already, node %d",
                                  doc->nodes[i].children[c], child->parent);
            child->parent = (int32_t)i;
        }
    uint32_t looping = 0;
    if (bd_scene_parents_are_a_forest(scene, &looping)) return BD_ERR_OK;
    return bd_err_set(reader->detail, BD_ERR_BAD_INPUT, bd_gltf_path("nodes[%u]", looping).text,
                      "is among its own ancestors");
}

// What no scene lists is hidden, and with it all below.
static enum bd_err show_scene(struct bd_gltf_reader *reader, uint32_t s)
{
    const struct bd_gltf_scene *in = &reader->doc->scenes[s];
    const struct bd_gltf_node *nodes = reader->doc->nodes;
    struct bd_scene *scene = reader->scene;
    for (uint32_t i = 0; i < scene->node_count; i++)
        scene->nodes[i].is_hidden |= scene->nodes[i].parent == BD_NONE;
    for (uint32_t i = 0; i < in->node_count; i++) {
        struct bd_node *root = &scene->nodes[in->nodes[i]];
        if (root->parent != BD_NONE)
            return bd_err_set(reader->detail, BD_ERR_BAD_INPUT,
                              bd_gltf_path("scenes[%u].nodes[%u]", s, i).text,
                              "node %d is not a root node", in->nodes[i]);
        root->is_hidden = nodes[in->nodes[i]].is_hidden;
    }
    return BD_ERR_OK;
}

// The scene that the file names, else its first; without any scene, all root nodes.
static enum bd_err show_nodes(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_document *doc = reader->doc;
    if (doc->scene_count == 0) return BD_ERR_OK;
    return show_scene(reader, doc->default_scene == BD_NONE ? 0 : (uint32_t)doc->default_scene);
}

static void read_node(struct bd_gltf_reader *reader, const struct bd_gltf_node *in,
                      struct bd_node *out)
{
    bd_gltf_copy_name(out->name, in->name);
    out->parent = BD_NONE;
    out->mesh = in->mesh;
    out->camera = in->camera;
    out->light = in->light;
    out->is_hidden = in->is_hidden;
    out->parent_from_node = matrix_of(reader, in);
}

enum bd_err bd_gltf_read_nodes(struct bd_gltf_reader *reader)
{
    const struct bd_gltf_document *doc = reader->doc;
    struct bd_scene *scene = reader->scene;
    scene->lights = calloc(doc->light_count + (size_t)1, sizeof *scene->lights);
    scene->cameras = calloc(doc->camera_count + (size_t)1, sizeof *scene->cameras);
    scene->nodes = calloc(doc->node_count + (size_t)1, sizeof *scene->nodes);
    if (!scene->lights || !scene->cameras || !scene->nodes)
        return bd_gltf_no_memory(reader, "nodes");
    scene->light_count = doc->light_count;
    scene->camera_count = doc->camera_count;
    scene->node_count = doc->node_count;
    for (uint32_t i = 0; i < doc->light_count; i++)
        read_light(reader, &doc->lights[i], &scene->lights[i]);
    for (uint32_t i = 0; i < doc->camera_count; i++)
        read_camera(reader, &doc->cameras[i], &scene->cameras[i]);
    for (uint32_t i = 0; i < doc->node_count; i++)
        read_node(reader, &doc->nodes[i], &scene->nodes[i]);
    enum bd_err err = adopt_children(reader);
    return err == BD_ERR_OK ? show_nodes(reader) : err;
}
