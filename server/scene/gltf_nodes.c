#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "scene/gltf_reader.h"

static const double pi = 3.14159265358979323846;

// Of what ends somewhere or nowhere: beyond every coordinate is nowhere.
static float distance_or_none(double value_m)
{
    return value_m > 0 && value_m <= BD_COORDINATE_MAX_M ? (float)value_m : INFINITY;
}

static void read_light(struct bd_gltf_reader *reader, const struct bd_gltf_light *in,
                       struct bd_light *out)
{
    bool repaired = false;
    bd_gltf_copy_name(out->name, in->name);
    out->kind = strcmp(in->type, "directional") == 0 ? BD_LIGHT_DIRECTIONAL
                : strcmp(in->type, "spot") == 0      ? BD_LIGHT_SPOT
                                                     : BD_LIGHT_POINT;
    for (int i = 0; i < 3; i++) {
        repaired |= !(in->color[i] >= 0 && in->color[i] <= 1e30);
        out->color[i] = (float)fmin(fmax(in->color[i], 0), 1e30);
    }
    repaired |= !(in->intensity >= 0 && in->intensity <= 1e30);
    out->intensity = (float)fmin(fmax(in->intensity, 0), 1e30);
    repaired |= in->range < 0;
    out->range_m = distance_or_none(in->range);
    if (out->kind == BD_LIGHT_SPOT) {
        const double outer_min = 1e-4, gap_min = 1e-5;
        out->cone_outer = (float)fmin(fmax(in->cone_outer, outer_min), 1.5707963);
        double inner_max = (double)out->cone_outer - gap_min;
        repaired |= !(in->cone_outer > 0 && in->cone_outer <= 0.5 * pi + 1e-6);
        repaired |= !(in->cone_inner >= 0 && in->cone_inner < in->cone_outer);
        out->cone_inner = (float)fmin(fmax(in->cone_inner, 0), inner_max);
    }
    reader->repairs.repaired_lights += repaired;
}

// Beyond every coordinate nothing is seen, as there.
static float near_plane(double value_m, double least_m, bool *repaired)
{
    *repaired |= !(value_m >= least_m && value_m <= BD_COORDINATE_MAX_M);
    return (float)fmin(fmax(value_m, least_m), BD_COORDINATE_MAX_M);
}

static void read_perspective(const struct bd_gltf_camera *in, struct bd_camera *out, bool *repaired)
{
    const double yfov_min = 1e-3, yfov_max = 0.99 * pi;
    const double near_min = FLT_MIN, near_usual = 1e-3;
    *repaired |= !(in->yfov >= yfov_min && in->yfov <= yfov_max);
    out->yfov = (float)fmin(fmax(in->yfov, yfov_min), yfov_max);
    *repaired |= !(in->near > 0);
    out->near_m = near_plane(in->near > 0 ? in->near : near_usual, near_min, repaired);
    out->far_m = distance_or_none(in->far);
}

// A negative magnification mirrors the picture in some tools; here its size is what counts.
static float magnification(double value, bool *repaired)
{
    *repaired |= !(value > 0);
    double size = fabs(value);
    bool usable = size >= 1e-9 && size <= BD_COORDINATE_MAX_M;
    *repaired |= !usable;
    return usable ? (float)size : 1.0f;
}

static void read_orthographic(const struct bd_gltf_camera *in, struct bd_camera *out,
                              bool *repaired)
{
    out->orthographic = true;
    out->xmag = magnification(in->xmag, repaired);
    out->ymag = magnification(in->ymag, repaired);
    out->near_m = near_plane(in->near, 0, repaired);
    out->far_m = distance_or_none(in->far);
}

static void read_camera(struct bd_gltf_reader *reader, const struct bd_gltf_camera *in,
                        struct bd_camera *out)
{
    bool repaired = false;
    bd_gltf_copy_name(out->name, in->name);
    if (in->orthographic)
        read_orthographic(in, out, &repaired);
    else
        read_perspective(in, out, &repaired);
    if (out->far_m <= out->near_m) {
        out->far_m = INFINITY;
        repaired = true;
    }
    reader->repairs.repaired_cameras += repaired;
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
                return bd_fault_set(reader->fault, BD_ERR_BAD_INPUT,
                                    bd_gltf_path("nodes[%u].children[%u]", i, c).text,
                                    "node %d has a parent already, node %d",
                                    doc->nodes[i].children[c], child->parent);
            child->parent = (int32_t)i;
        }
    uint32_t looping = 0;
    if (bd_scene_parents_are_a_forest(scene, &looping)) return BD_ERR_OK;
    return bd_fault_set(reader->fault, BD_ERR_BAD_INPUT, bd_gltf_path("nodes[%u]", looping).text,
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
            return bd_fault_set(reader->fault, BD_ERR_BAD_INPUT,
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
