#include "lights/surface_hits.h"

#include "lights/surface.h"

void bd_surface_hits_init(struct bd_surface_hits *hits, const struct bd_scene *scene)
{
    *hits = (struct bd_surface_hits){
        .roughest = BD_BRUSHED_ROUGHNESS, .scene = scene, .space = bd_render_space_of(scene)};
    bd_triangle_order_init(&hits->order, scene);
}

void bd_surface_hits_finish(struct bd_surface_hits *hits)
{
    bd_triangle_order_finish(&hits->order);
}

struct bd_surface_hit bd_surface_hit_of(const struct bd_surface_hits *hits, uint32_t triangle)
{
    const struct bd_scene *scene = hits->scene;
    const struct bd_triangle_run *run =
        &hits->order.runs[bd_triangle_order_run(&hits->order, triangle)];
    const uint64_t of_run = triangle - run->first_triangle;
    const uint64_t place = run->first_instance + of_run / run->triangles_per_instance;
    return (struct bd_surface_hit){
        .run = run,
        .instance = &scene->instances[hits->order.instances[place]],
        .primitive = &scene->meshes[run->mesh]->primitives[run->primitive],
        .of_primitive = (uint32_t)(of_run % run->triangles_per_instance),
    };
}

bool bd_surface_hit_triangle(const struct bd_surface_hits *hits, uint32_t triangle,
                             struct bd_hit_triangle *out)
{
    const struct bd_surface_hit hit = bd_surface_hit_of(hits, triangle);
    struct bd_triangle_place place;
    if (!bd_triangle_place_of(&hits->space, hit.run, hit.instance, hit.primitive, hit.of_primitive,
                              &place))
        return false;
    *out = (struct bd_hit_triangle){
        .corner = {place.corner[0], place.corner[1], place.corner[2]},
        .normal = place.normal,
        .two_sided = hits->scene->materials[hit.primitive->material].double_sided,
    };
    return true;
}

bool bd_surface_hit_at(const struct bd_surface_hits *hits, uint32_t triangle, float u, float v,
                       f3 direction, struct bd_surface_point *point)
{
    const struct bd_surface_hit hit = bd_surface_hit_of(hits, triangle);
    const struct bd_material *material = &hits->scene->materials[hit.primitive->material];
    struct bd_triangle_place found;
    if (material->unlit) return false;
    if (!bd_triangle_place_of(&hits->space, hit.run, hit.instance, hit.primitive, hit.of_primitive,
                              &found))
        return false;
    const bool is_behind = f3_dot(found.normal, direction) > 0;
    if (is_behind && !material->double_sided) return false;
    *point = (struct bd_surface_point){
        .position = bd_triangle_place_at(&found, u, v),
        .normal = f3_scale(found.normal, is_behind ? -1 : 1),
        .triangle = triangle,
    };
    return true;
}

f3 bd_surface_hit_diffuse(const struct bd_surface_hits *hits, uint32_t triangle, float u, float v,
                          enum bd_sends sends, float cosine)
{
    const struct bd_surface_hit hit = bd_surface_hit_of(hits, triangle);
    const uint32_t *index = hit.primitive->index + 3 * (size_t)hit.of_primitive;
    const f3 color = bd_base_color_at(hits->scene, hit.primitive, index, u, v).rgb;
    return bd_diffuse_of(hits->scene, hit.primitive, index, u, v, color, sends, cosine);
}

f3 bd_surface_hit_sent(const struct bd_surface_hits *hits, uint32_t triangle, float u, float v,
                       enum bd_sends sends, float cosine)
{
    const struct bd_surface_hit hit = bd_surface_hit_of(hits, triangle);
    const uint32_t *index = hit.primitive->index + 3 * (size_t)hit.of_primitive;
    return bd_sent_beside_interface(hits->scene, hit.primitive, index, u, v, sends,
                                    bd_surface_hit_diffuse(hits, triangle, u, v, sends, cosine));
}
