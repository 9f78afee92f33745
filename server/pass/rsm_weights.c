#include "pass/rsm_weights.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"

// Sub-samples of a cone's attenuation along a texel's side (hazard 60).
#define CONE_SUB_SAMPLES 4

static double corner_solid_angle(double u, double v)
{
    return atan2(u * v, sqrt(u * u + v * v + 1));
}

double bd_rectangle_solid_angle_sr(double u0, double u1, double v0, double v1)
{
    return corner_solid_angle(u1, v1) - corner_solid_angle(u0, v1) - corner_solid_angle(u1, v0) +
           corner_solid_angle(u0, v0);
}

struct cone {
    double cos_outer, per_cosine;
};

static struct cone cone_of(const struct bd_light *light)
{
    double cos_inner = cos(light->cone_inner), cos_outer = cos(light->cone_outer);
    return (struct cone){cos_outer, 1 / fmax(cos_inner - cos_outer, 1e-7)};
}

static double attenuation(const struct cone *cone, double cos_to_axis)
{
    double a = fmin(fmax((cos_to_axis - cone->cos_outer) * cone->per_cosine, 0), 1);
    return a * a;
}

// Cosine between the light's axis (-z) and the direction through (u, v) of a face. Six faces in
// the order of upload/light_setup.h.
static double cos_to_axis(uint32_t face_count, uint32_t face, double u, double v)
{
    double length = sqrt(u * u + v * v + 1);
    if (face_count == 1) return 1 / length;
    switch (face) {
    case 0: return -u / length; // looks along +x; its right is +z
    case 1: return u / length;
    case 2: return -v / length; // looks along +y; its up is +z
    case 3: return v / length;
    case 4: return -1 / length;
    default: return 1 / length;
    }
}

struct texel_bounds {
    double u0, u1, v0, v1;
};

static double mean_attenuation(const struct cone *cone, uint32_t face_count, uint32_t face,
                               const struct texel_bounds *t)
{
    double du = (t->u1 - t->u0) / CONE_SUB_SAMPLES, dv = (t->v1 - t->v0) / CONE_SUB_SAMPLES;
    double sum = 0;
    for (int y = 0; y < CONE_SUB_SAMPLES; y++)
        for (int x = 0; x < CONE_SUB_SAMPLES; x++)
            sum += attenuation(cone, cos_to_axis(face_count, face, t->u0 + (x + 0.5) * du,
                                                 t->v0 + (y + 0.5) * dv));
    return sum / (CONE_SUB_SAMPLES * CONE_SUB_SAMPLES);
}

struct face {
    uint32_t index, side;
    bool paper_mode;
    struct cone cone;
};

// One row of a perspective light's face, 0 its upper edge; returns the sum of its fluxes.
static double fill_row(const struct bd_light_setup *setup, const struct face *face, uint32_t y,
                       float *values)
{
    double t = setup->half_width, step = 2 * t / face->side, sum = 0;
    double texel_sr = bd_rectangle_solid_angle_sr(-t, t, -t, t) / ((double)face->side * face->side);
    const bool is_spot = setup->light->kind == BD_LIGHT_SPOT;
    for (uint32_t x = 0; x < face->side; x++) {
        struct texel_bounds b = {-t + x * step, -t + (x + 1) * step, t - (y + 1) * step,
                                 t - y * step};
        double sr =
            face->paper_mode ? texel_sr : bd_rectangle_solid_angle_sr(b.u0, b.u1, b.v0, b.v1);
        double part =
            is_spot ? mean_attenuation(&face->cone, setup->face_count, face->index, &b) : 1;
        values[2 * x] = (float)(sr * part);
        values[2 * x + 1] = (float)sr;
        sum += sr * part;
    }
    return sum;
}

static enum bd_err fill_face(const struct bd_light_setup *setup, const struct face *face,
                             struct bd_slicer *slicer, float *values, double *raw_sum)
{
    double sum = 0;
    for (uint32_t y = 0; y < face->side; y++) {
        sum += fill_row(setup, face, y, values + 2 * (size_t)face->side * y);
        enum bd_err err = slicer ? bd_slicer_pause(slicer) : BD_ERR_OK;
        if (err) return err;
    }
    *raw_sum += sum;
    return BD_ERR_OK;
}

static void fill_directional(const struct bd_light_setup *setup, double render_per_m,
                             struct bd_rsm_weights *weights)
{
    double width = 2 * setup->half_width * render_per_m / weights->side_px;
    double height = 2 * setup->half_height * render_per_m / weights->side_px;
    size_t count = (size_t)weights->side_px * weights->side_px;
    for (size_t i = 0; i < 2 * count; i++) weights->values[i] = (float)(width * height);
    weights->raw_sum = weights->exact_sum = width * height * (double)count;
}

static enum bd_err fill_faces(const struct bd_light_setup *light, bool paper_mode,
                              struct bd_slicer *slicer, struct bd_rsm_weights *weights)
{
    const size_t texels = (size_t)weights->side_px * weights->side_px;
    struct face face = {
        .side = weights->side_px,
        .paper_mode = paper_mode,
        .cone = cone_of(light->light),
    };
    for (; face.index < weights->layer_count; face.index++) {
        enum bd_err err = fill_face(light, &face, slicer, weights->values + 2 * texels * face.index,
                                    &weights->raw_sum);
        if (err) return err;
    }
    return BD_ERR_OK;
}

// The faces' fluxes together are what the closed form says.
static void normalise(struct bd_rsm_weights *weights)
{
    const size_t texels = (size_t)weights->side_px * weights->side_px;
    double scale = weights->raw_sum > 0 ? weights->exact_sum / weights->raw_sum : 0;
    for (size_t i = 0; scale > 0 && i < texels * weights->layer_count; i++)
        weights->values[2 * i] = (float)(weights->values[2 * i] * scale);
}

enum bd_err bd_rsm_weights_create(const struct bd_light_setup *light, double render_per_m,
                                  uint32_t side_px, bool paper_mode, struct bd_slicer *slicer,
                                  struct bd_rsm_weights *out)
{
    bool faces_alike = light->face_count == 1 || light->light->kind == BD_LIGHT_POINT;
    *out = (struct bd_rsm_weights){
        .side_px = side_px,
        .layer_count = faces_alike ? 1 : light->face_count,
    };
    out->values = malloc((size_t)side_px * side_px * out->layer_count * 2 * sizeof(float));
    BD_ASSERT(out->values);
    if (light->light->kind == BD_LIGHT_DIRECTIONAL) {
        fill_directional(light, render_per_m, out);
        return BD_ERR_OK;
    }
    enum bd_err err = fill_faces(light, paper_mode, slicer, out);
    if (err) {
        bd_rsm_weights_destroy(out);
        return err;
    }
    if (faces_alike) out->raw_sum *= light->face_count;
    out->exact_sum = bd_light_effective_solid_angle_sr(light->light);
    if (!paper_mode) normalise(out);
    return BD_ERR_OK;
}

void bd_rsm_weights_destroy(struct bd_rsm_weights *weights)
{
    free(weights->values);
    weights->values = NULL;
}
