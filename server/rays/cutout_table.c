#include "rays/cutout_table.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/huge_pages.h"

struct table {
    const struct bd_rays *rays;
    const struct bd_scene *scene;
    uint32_t *place_of_material; // in the table, by the scene's number; BD_NONE's bits: none
    uint64_t *place_of_picture;  // of its first texel
    uint32_t material_count;
    uint64_t texel_count;
    struct bd_ray_nodes *out;
};

#define NOWHERE UINT32_MAX

static const struct bd_picture *picture_of(const struct bd_scene *scene, uint32_t material)
{
    const int32_t map = scene->materials[material].base_color_map.texture;
    if (map == BD_NONE || scene->textures[map].picture == BD_NONE) return NULL;
    const struct bd_picture *picture = scene->pictures[scene->textures[map].picture];
    return picture && picture->width_px > 0 && picture->height_px > 0 ? picture : NULL;
}

static uint64_t *place_of(const struct table *table, uint32_t material)
{
    const int32_t map = table->scene->materials[material].base_color_map.texture;
    return &table->place_of_picture[table->scene->textures[map].picture];
}

// Materials of what is not opaque, and their pictures, in the order of the scene's.
static void lay_out(struct table *table)
{
    const struct bd_scene *scene = table->scene;
    memset(table->place_of_material, 0xff, scene->material_count * sizeof(uint32_t));
    memset(table->place_of_picture, 0xff, scene->picture_count * sizeof(uint64_t));
    for (uint32_t m = 0; m < scene->material_count; m++) {
        if (scene->materials[m].alpha_mode == BD_ALPHA_OPAQUE) continue;
        table->place_of_material[m] = table->material_count++;
        const struct bd_picture *picture = picture_of(scene, m);
        if (!picture || *place_of(table, m) != UINT64_MAX) continue;
        *place_of(table, m) = table->texel_count;
        table->texel_count += (uint64_t)picture->width_px * picture->height_px;
    }
}

static bool make_room(struct table *table, uint64_t bytes_max)
{
    struct bd_ray_nodes *out = table->out;
    const uint64_t records =
        (uint64_t)table->material_count * BD_CUTOUT_MATERIAL_UVEC4S +
        table->rays->levels[0].placed[BD_PLACED_CUTOUT].triangle_count * BD_CUTOUT_TRIANGLE_UVEC4S;
    if (records * sizeof *out->cutouts > bytes_max || table->texel_count > bytes_max - 3)
        return false;
    out->cutout_count = (size_t)records;
    out->texel_word_count = (size_t)(table->texel_count + 3) / 4;
    out->cutouts = bd_huge_pages_alloc(out->cutout_count * sizeof *out->cutouts);
    out->texels = bd_huge_pages_alloc((out->texel_word_count + 1) * sizeof *out->texels);
    return out->cutouts && out->texels;
}

static uint32_t bits_of(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static void fill_material(const struct table *table, uint32_t material)
{
    const struct bd_material *m = &table->scene->materials[material];
    const struct bd_picture *picture = picture_of(table->scene, material);
    const float *uv = m->base_color_map.uv_transform;
    struct bd_uvec4 *to = table->out->cutouts +
                          (size_t)table->place_of_material[material] * BD_CUTOUT_MATERIAL_UVEC4S;
    const bool blends = m->alpha_mode == BD_ALPHA_BLEND;
    memset(to, 0, BD_CUTOUT_MATERIAL_UVEC4S * sizeof *to);
    to[0].x = blends ? BD_CUTOUT_BLENDS : 0;
    to[0].y = bits_of(blends ? 0.5f : m->alpha_cutoff);
    to[0].z = bits_of(m->base_color[3]);
    if (!picture) return;
    const struct bd_texture *texture = &table->scene->textures[m->base_color_map.texture];
    to[0].x |= (uint32_t)texture->wrap_s * BD_CUTOUT_WRAP_S |
               (uint32_t)texture->wrap_t * BD_CUTOUT_WRAP_T |
               (texture->nearest ? BD_CUTOUT_NEAREST : 0);
    to[0].w = (uint32_t)*place_of(table, material);
    to[1] =
        (struct bd_uvec4){picture->width_px, picture->height_px, bits_of(uv[0]), bits_of(uv[1])};
    to[2] = (struct bd_uvec4){bits_of(uv[2]), bits_of(uv[3]), bits_of(uv[4]), bits_of(uv[5])};
}

static void fill_texels(const struct table *table, uint32_t material)
{
    const struct bd_picture *picture = picture_of(table->scene, material);
    if (!picture) return;
    uint8_t *to = (uint8_t *)table->out->texels + *place_of(table, material);
    const size_t count = (size_t)picture->width_px * picture->height_px;
    for (size_t i = 0; i < count; i++) to[i] = picture->rgba[4 * i + 3];
}

static void fill_triangle(const struct table *table, uint32_t index)
{
    const struct bd_placed_triangles *placed = &table->rays->levels[0].placed[BD_PLACED_CUTOUT];
    uint32_t triangle;
    const struct bd_primitive *primitive =
        bd_rays_primitive(table->rays, placed->numbers[index], &triangle);
    const uint32_t material = (uint32_t)primitive->material;
    const struct bd_texture_ref *map = &table->scene->materials[material].base_color_map;
    const float *uv = map->texture != BD_NONE ? primitive->uv[map->uv_set] : NULL;
    struct bd_uvec4 *to = table->out->cutouts +
                          (size_t)table->material_count * BD_CUTOUT_MATERIAL_UVEC4S +
                          (size_t)index * BD_CUTOUT_TRIANGLE_UVEC4S;
    for (int c = 0; c < 3; c++) {
        const size_t at = primitive->index[3 * (size_t)triangle + (size_t)c];
        const float alpha = primitive->color ? primitive->color[4 * at + 3] : 1;
        to[c] = (struct bd_uvec4){bits_of(uv ? uv[2 * at] : 0), bits_of(uv ? uv[2 * at + 1] : 0),
                                  bits_of(alpha), 0};
    }
    to[0].w = table->place_of_material[material] * BD_CUTOUT_MATERIAL_UVEC4S;
    to[1].w = uv && picture_of(table->scene, material);
    to[2].w = primitive->color != NULL;
}

static void fill(const struct table *table)
{
    for (uint32_t m = 0; m < table->scene->material_count; m++) {
        if (table->place_of_material[m] == NOWHERE) continue;
        fill_material(table, m);
        fill_texels(table, m);
    }
    const size_t count = table->rays->levels[0].placed[BD_PLACED_CUTOUT].triangle_count;
    for (uint32_t t = 0; t < count; t++) fill_triangle(table, t);
    table->out->cutout_triangles = table->material_count * BD_CUTOUT_MATERIAL_UVEC4S;
}

enum bd_err bd_cutout_table_make(const struct bd_rays *rays, uint64_t bytes_max,
                                 struct bd_ray_nodes *out, struct bd_err_detail *detail)
{
    const struct bd_scene *scene = rays->scene;
    struct table table = {.rays = rays, .scene = scene, .out = out};
    if (rays->levels[0].placed[BD_PLACED_CUTOUT].triangle_count == 0) return BD_ERR_OK;
    table.place_of_material = calloc(scene->material_count + 1, sizeof *table.place_of_material);
    table.place_of_picture = calloc(scene->picture_count + 1, sizeof *table.place_of_picture);
    BD_ASSERT(table.place_of_material && table.place_of_picture);
    lay_out(&table);
    enum bd_err err = BD_ERR_OK;
    if (make_room(&table, bytes_max < UINT32_MAX ? bytes_max : UINT32_MAX))
        fill(&table);
    else
        err = bd_err_set(detail, BD_ERR_UNSUPPORTED, "scene",
                         "%zu triangles and %llu texels that are not opaque",
                         rays->levels[0].placed[BD_PLACED_CUTOUT].triangle_count,
                         (unsigned long long)table.texel_count);
    free(table.place_of_material);
    free(table.place_of_picture);
    return err;
}
