#include "reference/emitters.h"

#include <math.h>
#include <stdlib.h>

#include "reference/vec3f.h"

static bool is_emissive(const struct bd_material *m)
{
    return !m->unlit && (m->emissive[0] > 0 || m->emissive[1] > 0 || m->emissive[2] > 0);
}

// As many as a tree holds. Further ones are found by scattering alone.
#define EMITTERS_MAX (1u << 30)

static uint32_t count_emitters(const struct bd_geometry *geometry)
{
    uint64_t count = 0;
    for (uint32_t p = 0; p < geometry->part_count; p++)
        if (is_emissive(geometry->parts[p].material))
            count += geometry->parts[p].primitive->index_count / 3;
    return count < EMITTERS_MAX ? (uint32_t)count : EMITTERS_MAX;
}

void bd_emission_at(const struct bd_geometry *geometry, const struct bd_intersection *at,
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
            struct bd_intersection at;
            bd_geometry_point(part, triangle, ((float)(j / 2) + third) / (float)rows,
                              ((float)i + third) / (float)rows, &at);
            bd_emission_at(geometry, &at, at.hit.normal_geometric, emission);
            sum += 0.2126 * emission[0] + 0.7152 * emission[1] + 0.0722 * emission[2];
        }
    return sum / (rows * rows);
}

static double area_of(const struct bd_triangle *triangle)
{
    bd_dvec3 p[3];
    for (int c = 0; c < 3; c++) {
        const float *at = triangle->corner[c];
        p[c] = (bd_dvec3){at[0], at[1], at[2]};
    }
    return 0.5 * bd_dvec3_length(
                     bd_dvec3_cross(bd_dvec3_sub(p[1], p[0]), bd_dvec3_sub(p[2], p[0])));
}

// --- listing ------------------------------------------------------------------------------------

// Of edges this small beside the scene nothing is ever seen, and the inverse is finite.
#define AREA_MIN 1e-30

static void list_part(struct bd_emitters *e, const struct bd_geometry *geometry, uint32_t index)
{
    const struct bd_part *part = &geometry->parts[index];
    for (uint32_t t = 0; t < part->primitive->index_count / 3 && e->count < EMITTERS_MAX; t++) {
        double area = area_of(&part->triangles[t]);
        e->part[e->count] = index;
        e->triangle[e->count] = t;
        e->inverse_area[e->count] = area > AREA_MIN ? (float)(1 / area) : 0;
        e->count++;
    }
}

struct listed {
    const struct bd_emitters *emitters;
    const struct bd_geometry *geometry;
};

static struct bd_tree_light light_at(const void *user, uint32_t index)
{
    const struct listed *listed = user;
    const struct bd_emitters *e = listed->emitters;
    const struct bd_part *part = &listed->geometry->parts[e->part[index]];
    const struct bd_triangle *triangle = &part->triangles[e->triangle[index]];
    struct bd_tree_light light = {.two_sided = part->material->double_sided};
    for (int k = 0; k < 3; k++) {
        float a = triangle->corner[0][k], b = triangle->corner[1][k], c = triangle->corner[2][k];
        light.low[k] = bd_minf(a, bd_minf(b, c));
        light.high[k] = bd_maxf(a, bd_maxf(b, c));
    }
    bd_vec3f_copy(light.axis, triangle->normal);
    if (e->inverse_area[index] > 0)
        light.power = mean_luminance(listed->geometry, part, e->triangle[index]) *
                      (light.two_sided ? 2 : 1) / e->inverse_area[index];
    return light;
}

static enum bd_err allocate(struct bd_emitters *emitters, size_t count,
                            struct bd_err_detail *detail)
{
    emitters->part = malloc(count * sizeof *emitters->part);
    emitters->triangle = malloc(count * sizeof *emitters->triangle);
    emitters->inverse_area = malloc(count * sizeof *emitters->inverse_area);
    if (emitters->part && emitters->triangle && emitters->inverse_area) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "reference", "no memory for %zu emissive triangles",
                      count);
}

enum bd_err bd_emitters_init(struct bd_emitters *emitters, struct bd_geometry *geometry,
                             struct bd_err_detail *detail)
{
    *emitters = (struct bd_emitters){0};
    size_t count = count_emitters(geometry);
    if (count == 0) return BD_ERR_OK;
    enum bd_err err = allocate(emitters, count, detail);
    if (err) return err;
    for (uint32_t p = 0; p < geometry->part_count; p++) {
        if (!is_emissive(geometry->parts[p].material)) continue;
        geometry->parts[p].first_emitter = emitters->count;
        list_part(emitters, geometry, p);
    }
    const struct listed listed = {emitters, geometry};
    err = bd_light_tree_init(&emitters->tree, emitters->count, false, light_at, &listed, detail);
    if (!err && emitters->tree.count == 0) emitters->count = 0;
    return err;
}

void bd_emitters_finish(struct bd_emitters *emitters)
{
    bd_light_tree_finish(&emitters->tree);
    free(emitters->part);
    free(emitters->triangle);
    free(emitters->inverse_area);
    *emitters = (struct bd_emitters){0};
}

uint64_t bd_emitters_bytes(const struct bd_emitters *e)
{
    return bd_light_tree_bytes(&e->tree, e->count) +
           e->count * (sizeof *e->part + sizeof *e->triangle + sizeof *e->inverse_area);
}

// --- choosing -----------------------------------------------------------------------------------

float bd_emitters_pdf(const struct bd_emitters *emitters, const struct bd_receiver *receiver,
                      const struct bd_part *part, uint32_t triangle)
{
    if (emitters->count == 0 || part->first_emitter == UINT32_MAX) return 0;
    uint64_t emitter = (uint64_t)part->first_emitter + triangle;
    if (emitter >= emitters->count || emitters->inverse_area[emitter] == 0) return 0;
    return emitters->inverse_area[emitter] *
           bd_light_tree_probability(&emitters->tree, receiver, (uint32_t)emitter);
}

void bd_emitters_choose(const struct bd_emitters *emitters, const struct bd_receiver *receiver,
                        uint32_t count, struct bd_light_draw *draws)
{
    bd_light_tree_choose(&emitters->tree, receiver, count, draws);
}

float bd_emitters_drawn_pdf(const struct bd_emitters *emitters, const struct bd_light_draw *draw)
{
    return draw->probability * emitters->inverse_area[draw->light];
}

void bd_emitters_point(const struct bd_emitters *emitters, const struct bd_geometry *geometry,
                       uint32_t emitter, const float u[2], struct bd_intersection *out)
{
    float root = sqrtf(u[0]);
    bd_geometry_point(&geometry->parts[emitters->part[emitter]], emitters->triangle[emitter],
                      root * u[1], 1 - root, out);
}
