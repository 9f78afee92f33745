// The pyramid of pictures that light is splatted into at several resolutions.

#include <stdlib.h>

#include "base/assert.h"
#include "pass/gather_fragments.h"
#include "pass/kernels.h"

static enum bd_err create_cleared(struct bd_gpu *gpu, const char *name, uint32_t width_px,
                                  uint32_t height_px, struct bd_tex **out,
                                  struct bd_err_detail *detail)
{
    static const float no_data[4];
    const struct bd_tex_desc desc = {
        .name = name,
        .format = BD_FORMAT_RGBA32F,
        .width_px = width_px,
        .height_px = height_px,
    };
    enum bd_err err = bd_tex_create(gpu, &desc, out, detail);
    if (!err) bd_tex_clear(gpu, *out, no_data);
    return err;
}

static enum bd_err create_all(struct bd_gpu *gpu, enum bd_light_vectors vectors,
                              struct bd_multires_light *light, struct bd_err_detail *detail)
{
    uint32_t width = light->layout.width_px, height = light->layout.height_px, wide, high;
    bd_multires_stack_size(&light->layout, &wide, &high);
    enum bd_err err = create_cleared(gpu, "light of pixels", width, height, &light->fine, detail);
    if (!err) err = create_cleared(gpu, "light of blocks", wide, high, &light->coarse, detail);
    if (!err && vectors != BD_LIGHT_VECTORS_NONE)
        err = create_cleared(gpu, "vector of blocks", wide, high, &light->coarse_vector, detail);
    if (!err && vectors == BD_LIGHT_VECTORS_ALL)
        err = create_cleared(gpu, "vector of pixels", width, height, &light->fine_vector, detail);
    return err;
}

enum bd_err bd_multires_light_create(struct bd_gpu *gpu, const struct bd_multires_layout *layout,
                                     enum bd_light_vectors vectors, struct bd_multires_light **out,
                                     struct bd_err_detail *detail)
{
    struct bd_multires_light *light = calloc(1, sizeof *light);
    BD_ASSERT(light);
    light->layout = *layout;
    enum bd_err err = create_all(gpu, vectors, light, detail);
    if (err) {
        bd_multires_light_destroy(gpu, &light);
        return err;
    }
    *out = light;
    return BD_ERR_OK;
}

enum bd_err bd_multires_light_add_noise(struct bd_gpu *gpu, struct bd_multires_light *light,
                                        struct bd_err_detail *detail)
{
    uint32_t wide, high;
    bd_multires_stack_size(&light->layout, &wide, &high);
    enum bd_err err = create_cleared(gpu, "noise of pixels", light->layout.width_px,
                                     light->layout.height_px, &light->fine_noise, detail);
    return err ? err
               : create_cleared(gpu, "noise of blocks", wide, high, &light->coarse_noise, detail);
}

void bd_multires_light_bind(const void *light, struct bd_bindings *bindings)
{
    const struct bd_multires_light *out = light;
    bd_bind_image(bindings, 0, out->fine, false, true);
    bd_bind_image(bindings, 1, out->coarse, false, true);
    bd_bind_image(bindings, 2, out->fine_vector, false, true);
    bd_bind_image(bindings, 3, out->coarse_vector, false, true);
    bd_bind_image(bindings, 4, out->fine_noise, false, true);
    bd_bind_image(bindings, 5, out->coarse_noise, false, true);
}

void bd_multires_light_destroy(struct bd_gpu *gpu, struct bd_multires_light **light)
{
    if (!*light) return;
    bd_tex_destroy(gpu, &(*light)->fine);
    bd_tex_destroy(gpu, &(*light)->coarse);
    bd_tex_destroy(gpu, &(*light)->fine_vector);
    bd_tex_destroy(gpu, &(*light)->coarse_vector);
    bd_tex_destroy(gpu, &(*light)->fine_noise);
    bd_tex_destroy(gpu, &(*light)->coarse_noise);
    free(*light);
    *light = NULL;
}
