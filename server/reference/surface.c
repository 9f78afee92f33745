#include "reference/surface.h"

#include <math.h>
#include <stddef.h>

#include "reference/texture.h"
#include "reference/vec3f.h"

// --- what the vertices say ----------------------------------------------------------------------

// Weights of the three corners.
struct weights {
    float of[3];
};

static struct weights weights_of(const struct bd_hit *hit)
{
    return (struct weights){{1 - hit->u - hit->v, hit->u, hit->v}};
}

// Of what is asked for rarely, and therefore left where the mesh has it.
static void interpolate(const struct bd_hit *hit, const float *stream, size_t width,
                        const struct weights *weights, float *out)
{
    const uint32_t *index = hit->primitive->index + 3 * (size_t)hit->triangle;
    for (size_t k = 0; k < width; k++) out[k] = 0;
    for (int c = 0; c < 3; c++) {
        const float *at = stream + width * index[c];
        for (size_t k = 0; k < width; k++) out[k] += weights->of[c] * at[k];
    }
}

// --- maps ---------------------------------------------------------------------------------------

static const struct bd_texture *texture_of(const struct bd_scene *scene, const struct bd_hit *hit,
                                           const struct bd_texture_ref *ref)
{
    if (ref->texture == BD_NONE || !hit->primitive->uv[ref->uv_set]) return NULL;
    return &scene->textures[ref->texture];
}

static void map_coordinates(const struct bd_hit *hit, const struct bd_texture_ref *ref,
                            const struct weights *weights, float out[2])
{
    float uv[2] = {0, 0};
    if (ref->uv_set == 0) {
        for (int c = 0; c < 3; c++) {
            const float *at = hit->corners[c].uv;
            for (int k = 0; k < 2; k++) uv[k] += weights->of[c] * at[k];
        }
    } else {
        interpolate(hit, hit->primitive->uv[ref->uv_set], 2, weights, uv);
    }
    const float *m = ref->uv_transform;
    out[0] = m[0] * uv[0] + m[1] * uv[1] + m[2];
    out[1] = m[3] * uv[0] + m[4] * uv[1] + m[5];
}

// False if there is no such map: a factor stands alone.
static bool map_at(const struct bd_scene *scene, const struct bd_hit *hit,
                   const struct bd_texture_ref *ref, const struct weights *weights, bool srgb,
                   float out[4])
{
    const struct bd_texture *texture = texture_of(scene, hit, ref);
    if (!texture) return false;
    float uv[2];
    map_coordinates(hit, ref, weights, uv);
    bd_texture_at(scene, texture, srgb, uv[0], uv[1], out);
    return true;
}

static const struct bd_material *material_of(const struct bd_scene *scene, const struct bd_hit *hit)
{
    return &scene->materials[hit->primitive->material];
}

float bd_surface_alpha(const struct bd_scene *scene, const struct bd_hit *hit)
{
    const struct bd_material *material = material_of(scene, hit);
    const struct bd_texture_ref *ref = &material->base_color_map;
    const struct bd_texture *texture = texture_of(scene, hit, ref);
    struct weights weights = weights_of(hit);
    float alpha = material->base_color[3];
    if (texture) {
        float uv[2];
        map_coordinates(hit, ref, &weights, uv);
        alpha *= bd_texture_alpha_at(scene, texture, uv[0], uv[1]);
    }
    if (hit->primitive->color) {
        float color[4];
        interpolate(hit, hit->primitive->color, 4, &weights, color);
        alpha *= color[3];
    }
    return alpha;
}

static void base_color_at(const struct bd_scene *scene, const struct bd_hit *hit,
                          const struct weights *weights, float out[3])
{
    const struct bd_material *material = material_of(scene, hit);
    float map[4], color[4];
    bd_vec3f_copy(out, material->base_color);
    if (map_at(scene, hit, &material->base_color_map, weights, true, map))
        bd_vec3f_filter(out, out, map);
    if (!hit->primitive->color) return;
    interpolate(hit, hit->primitive->color, 4, weights, color);
    bd_vec3f_filter(out, out, color);
}

static void emission_at(const struct bd_scene *scene, const struct bd_hit *hit,
                        const struct weights *weights, float out[3])
{
    const struct bd_material *material = material_of(scene, hit);
    float map[4];
    bd_vec3f_copy(out, material->emissive);
    if (out[0] == 0 && out[1] == 0 && out[2] == 0) return;
    if (map_at(scene, hit, &material->emissive_map, weights, true, map))
        bd_vec3f_filter(out, out, map);
}

// --- normals ------------------------------------------------------------------------------------

// Bends `n` by the material's normal map, if it has one. The frame is used as interpolated, neither
// unit nor orthogonal, with the bitangent from the cross product: as MikkTSpace bakes it.
static void bend(const struct bd_scene *scene, const struct bd_hit *hit,
                 const struct weights *weights, float n[3])
{
    const struct bd_material *material = material_of(scene, hit);
    float map[4], t[3] = {0, 0, 0}, b[3], bent[3], handedness = 0;
    if (!hit->tangents) return;
    if (!map_at(scene, hit, &material->normal_map, weights, false, map)) return;
    for (int c = 0; c < 3; c++) {
        bd_vec3f_add_scaled(t, t, hit->tangents[c].tangent, weights->of[c]);
        handedness += weights->of[c] * hit->tangents[c].handedness;
    }
    bd_vec3f_cross(b, n, t);
    float x = (2 * map[0] - 1) * material->normal_scale;
    float y = (2 * map[1] - 1) * material->normal_scale * handedness;
    bd_vec3f_scale(bent, n, 2 * map[2] - 1);
    bd_vec3f_add_scaled(bent, bent, t, x);
    bd_vec3f_add_scaled(bent, bent, b, y);
    if (bd_vec3f_dot(bent, bent) > 0) bd_vec3f_copy(n, bent);
}

// Which way they are turned: struct bd_primitive, scene/model/scene.h.
static void normals_at(const struct bd_scene *scene, const struct bd_hit *hit,
                       const struct weights *weights, bool from_behind, struct bd_surface *out)
{
    bd_vec3f_scale(out->normal_geometric, hit->normal_geometric, from_behind ? -1 : 1);
    float n[3] = {0, 0, 0};
    for (int c = 0; c < 3; c++) bd_vec3f_add_scaled(n, n, hit->corners[c].normal, weights->of[c]);
    bend(scene, hit, weights, n);
    if (!bd_vec3f_normalize(n)) {
        bd_vec3f_copy(out->normal, out->normal_geometric);
        return;
    }
    bool turned = bd_vec3f_dot(n, out->normal_geometric) < 0;
    bd_vec3f_scale(out->normal, n, turned ? -1 : 1);
}

// --- the whole ----------------------------------------------------------------------------------

static void metal_and_glass_at(const struct bd_scene *scene, const struct bd_hit *hit,
                               const struct weights *weights, bool transmission,
                               struct bd_surface *out)
{
    const struct bd_material *material = material_of(scene, hit);
    float map[4];
    out->metallic = material->metallic;
    out->roughness = material->roughness;
    if (map_at(scene, hit, &material->metallic_roughness_map, weights, false, map)) {
        out->metallic *= map[2];
        out->roughness *= map[1];
    }
    if (!transmission || material->transmission == 0) return;
    out->transmission = material->transmission;
    if (map_at(scene, hit, &material->transmission_map, weights, false, map))
        out->transmission *= map[0];
}

// Nothing comes back: the rear of a one-sided surface, met by a ray that is not the camera's.
static void make_black(struct bd_surface *out)
{
    out->lambert = true;
    out->transmission = 0;
    bd_vec3f_set(out->base_color, 0, 0, 0);
}

void bd_surface_at(const struct bd_scene *scene, const struct bd_hit *hit, const float wo[3],
                   bool lambert, bool transmission, struct bd_surface *out)
{
    const struct bd_material *material = material_of(scene, hit);
    struct weights weights = weights_of(hit);
    bool from_behind = bd_vec3f_dot(hit->normal_geometric, wo) < 0;
    *out = (struct bd_surface){
        .ior = material->ior,
        .thin = !(material->thickness_m > 0),
        .entering = !from_behind,
        .lambert = lambert,
        .unlit = material->unlit,
    };
    normals_at(scene, hit, &weights, from_behind, out);
    if (!lambert) metal_and_glass_at(scene, hit, &weights, transmission, out);
    bool is_rear = from_behind && !material->double_sided;
    // Light leaves a solid through the rear of its surface, whatever glTF's culling flag says.
    if (is_rear && out->transmission == 0) {
        make_black(out);
        return;
    }
    base_color_at(scene, hit, &weights, out->base_color);
    if (material->unlit) {
        bd_vec3f_copy(out->emission, out->base_color);
        make_black(out);
    } else if (!is_rear) {
        emission_at(scene, hit, &weights, out->emission);
    }
}
