#include "reference/emitters.h"

#include <math.h>
#include <stdlib.h>

#include "reference/vec3f.h"

static bool is_emissive(const struct bd_material *m)
{
    return !m->unlit && (m->emissive[0] > 0 || m->emissive[1] > 0 || m->emissive[2] > 0);
}

static uint32_t count_emitters(const struct bd_geometry *geometry)
{
    uint64_t count = 0;
    for (uint32_t p = 0; p < geometry->part_count; p++)
        if (is_emissive(geometry->parts[p].material))
            count += geometry->parts[p].primitive->index_count / 3;
    return count < UINT32_MAX ? (uint32_t)count : UINT32_MAX;
}

void bd_emission_at(const struct bd_geometry *geometry, const struct bd_meeting *at,
                    const float wo[3], float out[3])
{
    const struct bd_material *m = at->part->material;
    bd_vec3f_set(out, 0, 0, 0);
    if (!m->double_sided && bd_vec3f_dot(at->hit.normal_geometric, wo) < 0) return;
    if (m->emissive_map.texture == BD_NONE) {
        bd_vec3f_copy(out, m->emissive);
        return;
    }
    struct bd_surface surface;
    bd_surface_at(geometry->scene, &at->hit, wo, true, false, &surface);
    bd_vec3f_copy(out, surface.emission);
}

// The middles of 16 equal triangles: where a map is looked at for a triangle's power. What they
// miss is still found by rays that scatter into it.
static double mean_luminance(const struct bd_geometry *geometry, const struct bd_part *part,
                             uint32_t triangle)
{
    const int rows = part->material->emissive_map.texture == BD_NONE ? 1 : 4;
    double sum = 0;
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < 2 * (rows - i) - 1; j++) {
            float third = j % 2 ? 2.0f / 3 : 1.0f / 3, emission[3];
            struct bd_meeting at;
            bd_geometry_point(part, triangle, ((float)(j / 2) + third) / (float)rows,
                              ((float)i + third) / (float)rows, &at);
            bd_emission_at(geometry, &at, at.hit.normal_geometric, emission);
            sum += 0.2126 * emission[0] + 0.7152 * emission[1] + 0.0722 * emission[2];
        }
    return sum / (rows * rows);
}

static double area_of(const struct bd_part *part, uint32_t triangle)
{
    const uint32_t *index = part->primitive->index + 3 * (size_t)triangle;
    bd_dvec3 p[3];
    for (int c = 0; c < 3; c++) {
        const float *at = part->position + 3 * (size_t)index[c];
        p[c] = (bd_dvec3){at[0], at[1], at[2]};
    }
    return 0.5 * bd_dvec3_length(
                     bd_dvec3_cross(bd_dvec3_sub(p[1], p[0]), bd_dvec3_sub(p[2], p[0])));
}

static void list_part(struct bd_emitters *e, const struct bd_geometry *geometry, uint32_t index)
{
    const struct bd_part *part = &geometry->parts[index];
    double sides = part->material->double_sided ? 2 : 1;
    for (uint32_t t = 0; t < part->primitive->index_count / 3 && e->count < UINT32_MAX; t++) {
        double area = area_of(part, t);
        double power = area > 0 ? sides * area * mean_luminance(geometry, part, t) : 0;
        e->part[e->count] = index;
        e->triangle[e->count] = t;
        e->cumulated[e->count] = power + (e->count ? e->cumulated[e->count - 1] : 0);
        e->density[e->count] = power > 0 ? (float)(power / area) : 0;
        e->count++;
    }
}

static void normalize(struct bd_emitters *e)
{
    double sum = e->count ? e->cumulated[e->count - 1] : 0;
    if (!(sum > 0)) {
        e->count = 0;
        return;
    }
    for (uint32_t i = 0; i < e->count; i++) {
        e->cumulated[i] /= sum;
        e->density[i] = (float)(e->density[i] / sum);
    }
}

enum bd_err bd_emitters_init(struct bd_emitters *emitters, struct bd_geometry *geometry,
                             struct bd_fault *fault)
{
    *emitters = (struct bd_emitters){0};
    size_t count = count_emitters(geometry);
    if (count == 0) return BD_ERR_OK;
    emitters->part = malloc(count * sizeof *emitters->part);
    emitters->triangle = malloc(count * sizeof *emitters->triangle);
    emitters->cumulated = malloc(count * sizeof *emitters->cumulated);
    emitters->density = malloc(count * sizeof *emitters->density);
    if (!emitters->part || !emitters->triangle || !emitters->cumulated || !emitters->density)
        return bd_fault_set(fault, BD_ERR_NO_MEMORY, "reference",
                            "no memory for %zu emissive triangles", count);
    for (uint32_t p = 0; p < geometry->part_count; p++) {
        if (!is_emissive(geometry->parts[p].material)) continue;
        geometry->parts[p].first_emitter = emitters->count;
        list_part(emitters, geometry, p);
    }
    normalize(emitters);
    return BD_ERR_OK;
}

void bd_emitters_finish(struct bd_emitters *emitters)
{
    free(emitters->part);
    free(emitters->triangle);
    free(emitters->cumulated);
    free(emitters->density);
    *emitters = (struct bd_emitters){0};
}

float bd_emitters_density(const struct bd_emitters *emitters, const struct bd_part *part,
                          uint32_t triangle)
{
    if (emitters->count == 0 || part->first_emitter == UINT32_MAX) return 0;
    return emitters->density[part->first_emitter + triangle];
}

static uint32_t choose(const struct bd_emitters *emitters, double choice)
{
    uint32_t low = 0, high = emitters->count - 1;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (emitters->cumulated[middle] > choice)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

void bd_emitters_sample(const struct bd_emitters *emitters, const struct bd_geometry *geometry,
                        uint32_t choice, const float u[2], struct bd_meeting *out)
{
    uint32_t i = choose(emitters, choice * 0x1p-32);
    float root = sqrtf(u[0]);
    bd_geometry_point(&geometry->parts[emitters->part[i]], emitters->triangle[i], root * u[1],
                      1 - root, out);
}
