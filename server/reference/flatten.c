#include "reference/flatten.h"

#include "reference/vec3f.h"

static bool is_drawn(const struct bd_primitive *primitive)
{
    return primitive->index_count > 0;
}

static bool is_bent(const struct bd_scene *scene, const struct bd_primitive *primitive)
{
    return primitive->tangent &&
           scene->materials[primitive->material].normal_map.texture != BD_NONE;
}

struct bd_flat_counts bd_flatten_count(const struct bd_scene *scene)
{
    struct bd_flat_counts counts = {0};
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct bd_mesh *mesh = scene->meshes[scene->instances[i].mesh];
        for (uint32_t p = 0; p < mesh->primitive_count; p++) {
            const struct bd_primitive *primitive = &mesh->primitives[p];
            if (!is_drawn(primitive)) continue;
            counts.parts++;
            counts.vertices += primitive->vertex_count;
            counts.triangles += primitive->index_count / 3;
            if (is_bent(scene, primitive)) counts.bent_triangles += primitive->index_count / 3;
        }
    }
    return counts;
}

// Where the next part's share of each array begins.
struct cursor {
    float *position;
    struct bd_triangle *triangle;
    struct bd_triangle_tangents *tangents;
};

static void place_vertices(const struct bd_geometry *g, const struct bd_part *part,
                           struct cursor *at)
{
    const struct bd_primitive *primitive = part->primitive;
    for (uint32_t v = 0; v < primitive->vertex_count; v++, at->position += 3) {
        const float *p = primitive->position + 3 * (size_t)v;
        bd_dvec3 world =
            bd_dmat4_point(&part->instance->world_from_mesh, (bd_dvec3){p[0], p[1], p[2]});
        bd_dvec3 placed = bd_geometry_place(g, world);
        bd_vec3f_set(at->position, (float)placed.x, (float)placed.y, (float)placed.z);
    }
}

static void fill_triangles(const struct bd_part *part, const struct bd_linear *linear,
                           struct cursor *at)
{
    const struct bd_primitive *primitive = part->primitive;
    for (uint32_t i = 0; i + 2 < primitive->index_count; i += 3) {
        const uint32_t *index = primitive->index + i;
        struct bd_triangle *triangle = at->triangle++;
        *triangle = bd_triangle_of(part->position + 3 * (size_t)index[0],
                                   part->position + 3 * (size_t)index[1],
                                   part->position + 3 * (size_t)index[2], part->mirrored);
        for (int c = 0; c < 3; c++)
            triangle->shading[c] = bd_shading_vertex_of(primitive, index[c], linear);
        if (!part->tangents) continue;
        for (int c = 0; c < 3; c++)
            at->tangents->corner[c] = bd_shading_tangent_of(primitive, index[c], linear);
        at->tangents++;
    }
}

static void flatten_primitive(struct bd_geometry *g, const struct bd_instance *instance,
                              const struct bd_primitive *primitive, struct cursor *at)
{
    const struct bd_linear linear = bd_linear_of(&instance->world_from_mesh);
    struct bd_part *part = &g->parts[g->part_count++];
    *part = (struct bd_part){
        .instance = instance,
        .primitive = primitive,
        .material = &g->scene->materials[primitive->material],
        .position = at->position,
        .triangles = at->triangle,
        .tangents = is_bent(g->scene, primitive) ? at->tangents : NULL,
        .mirrored = linear.mirrored,
        .first_emitter = UINT32_MAX,
    };
    place_vertices(g, part, at);
    fill_triangles(part, &linear, at);
}

void bd_flatten(struct bd_geometry *g)
{
    const struct bd_shape_arrays arrays = bd_shape_arrays_of(g->shape);
    struct cursor at = {arrays.positions, arrays.triangles, arrays.tangents};
    for (uint32_t i = 0; i < g->scene->instance_count; i++) {
        const struct bd_instance *instance = &g->scene->instances[i];
        const struct bd_mesh *mesh = g->scene->meshes[instance->mesh];
        for (uint32_t p = 0; p < mesh->primitive_count; p++)
            if (is_drawn(&mesh->primitives[p]))
                flatten_primitive(g, instance, &mesh->primitives[p], &at);
    }
}

void bd_flatten_like(struct bd_geometry *g, const struct bd_geometry *like)
{
    for (uint32_t i = 0; i < g->scene->instance_count; i++) {
        const struct bd_instance *instance = &g->scene->instances[i];
        const struct bd_mesh *mesh = g->scene->meshes[instance->mesh];
        for (uint32_t p = 0; p < mesh->primitive_count; p++) {
            if (!is_drawn(&mesh->primitives[p])) continue;
            struct bd_part *part = &g->parts[g->part_count];
            *part = like->parts[g->part_count++];
            part->instance = instance;
            part->primitive = &mesh->primitives[p];
            part->material = &g->scene->materials[mesh->primitives[p].material];
            part->first_emitter = UINT32_MAX;
        }
    }
}
