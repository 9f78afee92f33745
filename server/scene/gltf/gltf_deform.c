// Morph targets and skins, applied once in the pose that a file comes with.

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf_reader.h"

static enum bd_err add_target(struct bd_gltf_reader *reader, int32_t accessor, const uint32_t *pick,
                              double weight, uint32_t vertex_count, float *delta, float *stream,
                              uint32_t stride)
{
    for (size_t i = 0; i < 3 * (size_t)vertex_count; i++) delta[i] = 0;
    enum bd_err err = bd_gltf_read_floats(reader, accessor, pick, vertex_count, 3, delta);
    if (err != BD_ERR_OK) return err;
    for (size_t v = 0; v < vertex_count; v++)
        for (size_t c = 0; c < 3; c++)
            stream[v * stride + c] += (float)(weight * (double)delta[3 * v + c]);
    return BD_ERR_OK;
}

static enum bd_err morph(struct bd_gltf_reader *reader, const struct bd_gltf_deform *deform,
                         const struct bd_gltf_primitive *in, const uint32_t *pick,
                         struct bd_primitive *out)
{
    float *delta = malloc((3 * (size_t)out->vertex_count + 1) * sizeof *delta);
    if (!delta) return bd_gltf_no_memory(reader, "meshes");
    enum bd_err err = BD_ERR_OK;
    for (uint32_t t = 0; t < in->target_count && t < deform->weight_count; t++) {
        double weight = deform->weights[t];
        const struct {
            const char *name;
            float *stream;
            uint32_t stride;
        } parts[] = {{"POSITION", out->position, 3},
                     {"NORMAL", out->normal, 3},
                     {"TANGENT", out->tangent, 4}};
        for (int i = 0; err == BD_ERR_OK && weight != 0 && i < 3; i++) {
            int32_t accessor = bd_gltf_attribute(&in->targets[t], parts[i].name);
            if (accessor == BD_NONE || !parts[i].stream) continue;
            err = add_target(reader, accessor, pick, weight, out->vertex_count, delta,
                             parts[i].stream, parts[i].stride);
        }
    }
    free(delta);
    return err;
}

// One vertex's matrices, weighted. Weights that do not sum to one are scaled; joints that do not
// exist count for nothing.
struct blend {
    double m[16];
    double weight;
};

static bool add_joints(const struct bd_gltf_deform *deform, const float joints[4],
                       const float weights[4], struct blend *blend)
{
    bool odd = false;
    for (int k = 0; k < 4; k++) {
        bool valid = joints[k] >= 0 && joints[k] < (float)deform->joint_count && weights[k] > 0 &&
                     weights[k] <= 1e6f;
        odd |= !valid && weights[k] != 0;
        if (!valid) continue;
        const bd_dmat4 *joint = &deform->world_from_bind[(uint32_t)joints[k]];
        for (int i = 0; i < 16; i++) blend->m[i] += (double)weights[k] * joint->m[i];
        blend->weight += (double)weights[k];
    }
    return odd;
}

// Normals go by the matrix of cofactors, which is the inverse transpose up to a factor and exists
// for every matrix.
static bd_dvec3 transformed_normal(const double *m, bd_dvec3 n)
{
    bd_dvec3 x = {m[0], m[1], m[2]}, y = {m[4], m[5], m[6]}, z = {m[8], m[9], m[10]};
    double mirrored = bd_dvec3_dot(bd_dvec3_cross(x, y), z) < 0 ? -1 : 1;
    bd_dvec3 sum = bd_dvec3_scale(bd_dvec3_cross(y, z), n.x);
    sum = bd_dvec3_add(sum, bd_dvec3_scale(bd_dvec3_cross(z, x), n.y));
    sum = bd_dvec3_add(sum, bd_dvec3_scale(bd_dvec3_cross(x, y), n.z));
    return bd_dvec3_scale(sum, mirrored);
}

static void store(float *out, bd_dvec3 v)
{
    out[0] = (float)v.x;
    out[1] = (float)v.y;
    out[2] = (float)v.z;
}

static void skin_vertex(struct bd_primitive *out, size_t v, const struct blend *blend)
{
    bd_dmat4 world_from_vertex;
    for (int i = 0; i < 16; i++) world_from_vertex.m[i] = blend->m[i] / blend->weight;
    float *p = out->position + 3 * v;
    store(p, bd_dmat4_point(&world_from_vertex, (bd_dvec3){p[0], p[1], p[2]}));
    if (out->normal) {
        float *n = out->normal + 3 * v;
        bd_dvec3 turned = transformed_normal(world_from_vertex.m, (bd_dvec3){n[0], n[1], n[2]});
        store(n, bd_dvec3_normalize(turned, (bd_dvec3){0, 0, 0}));
    }
    if (out->tangent) {
        float *t = out->tangent + 4 * v;
        bd_dvec3 turned = bd_dmat4_direction(&world_from_vertex, (bd_dvec3){t[0], t[1], t[2]});
        store(t, bd_dvec3_normalize(turned, (bd_dvec3){0, 0, 0}));
        if (bd_dmat4_determinant3(&world_from_vertex) < 0) t[3] = -t[3];
    }
}

// Reads whole streams: an element at a time would search a sparse accessor once a vertex.
static enum bd_err read_influences(struct bd_gltf_reader *reader, int32_t joints, int32_t weights,
                                   const uint32_t *pick, uint32_t count, float *joint,
                                   float *weight)
{
    memset(joint, 0, 4 * (size_t)count * sizeof *joint);
    memset(weight, 0, 4 * (size_t)count * sizeof *weight);
    enum bd_err err = bd_gltf_read_floats(reader, joints, pick, count, 4, joint);
    return err == BD_ERR_OK ? bd_gltf_read_floats(reader, weights, pick, count, 4, weight) : err;
}

static enum bd_err blend_set(struct bd_gltf_reader *reader, const struct bd_gltf_deform *deform,
                             const struct bd_gltf_primitive *in, uint32_t set, const uint32_t *pick,
                             uint32_t count, struct blend *blends)
{
    char name[32];
    snprintf(name, sizeof name, "JOINTS_%u", set);
    int32_t joints = bd_gltf_attribute(&in->attributes, name);
    snprintf(name, sizeof name, "WEIGHTS_%u", set);
    int32_t weights = bd_gltf_attribute(&in->attributes, name);
    if (joints == BD_NONE || weights == BD_NONE) return BD_ERR_OK;
    float *joint = malloc((8 * (size_t)count + 1) * sizeof *joint);
    if (!joint) return bd_gltf_no_memory(reader, "skins");
    float *weight = joint + 4 * (size_t)count;
    enum bd_err err = read_influences(reader, joints, weights, pick, count, joint, weight);
    for (size_t v = 0; err == BD_ERR_OK && v < count; v++)
        reader->repairs.odd_skin_weights +=
            add_joints(deform, joint + 4 * v, weight + 4 * v, &blends[v]);
    free(joint);
    return err;
}

static enum bd_err skin(struct bd_gltf_reader *reader, const struct bd_gltf_deform *deform,
                        const struct bd_gltf_primitive *in, const uint32_t *pick,
                        struct bd_primitive *out)
{
    const uint32_t set_count = 4;
    struct blend *blends = calloc(out->vertex_count + (size_t)1, sizeof *blends);
    if (!blends) return bd_gltf_no_memory(reader, "skins");
    enum bd_err err = BD_ERR_OK;
    for (uint32_t set = 0; err == BD_ERR_OK && set < set_count; set++)
        err = blend_set(reader, deform, in, set, pick, out->vertex_count, blends);
    for (uint32_t v = 0; err == BD_ERR_OK && v < out->vertex_count; v++) {
        if (blends[v].weight > 0)
            skin_vertex(out, v, &blends[v]);
        else
            reader->repairs.odd_skin_weights++;
    }
    free(blends);
    return err;
}

enum bd_err bd_gltf_deform(struct bd_gltf_reader *reader, const struct bd_gltf_deform *deform,
                           const struct bd_gltf_primitive *in, const uint32_t *pick,
                           struct bd_primitive *out)
{
    enum bd_err err = BD_ERR_OK;
    if (in->target_count > 0 && deform->weight_count > 0)
        err = morph(reader, deform, in, pick, out);
    if (err == BD_ERR_OK && deform->joint_count > 0) err = skin(reader, deform, in, pick, out);
    return err;
}
