#include "pass/scene_draws.h"

#include <math.h>

#include "pass/scene_material.h"
#include "pass/scene_parts.h"
#include "pass/scene_points.h"
#include "pass/scene_spans.h"
#include "shared/bindings.h"
#include "shared/instance.h"

// In the slicer's unit, an evaluation of a VPL; measured on the software device on Sponza and the
// dragon.
#define UNITS_PER_DRAW          2000.0
#define UNITS_PER_TRIANGLE      120.0
#define UNITS_PER_SURFACE_PIXEL 50.0
#define UNITS_PER_ID_PIXEL      10.0
// A band draws all triangles again. Its pixels cost at least this much more than they do, unless
// that would make it longer than so many slices.
#define PIXELS_PER_TRIANGLE_COST 2.0
#define BAND_SLICES_MAX          40.0
// Triangles of a view from which on the sieve pays, altogether and for each pixel; measured on
// waves of 10^4 to 10^7 triangles.
#define SIEVED_LEAST     65536.0
#define SIEVED_PER_PIXEL 0.125
// Between parts a slice that has lasted its time ends, whatever was expected of its triangles.
#define PARTS_PER_SLICE 4.0
// How many pixels a triangle covers shows when it is drawn, and the host sees it at the next
// checkpoint only. So a band begins with as many triangles as would last so many slices if each of
// them covered all of it; then a slice may hold so many times what the last one did, or as many as
// would have lasted a slice at that one's pace.
#define SLICES_AT_WORST 16.0
#define SLICE_GROWTH    4.0

static void set_attributes(struct bd_attribute attributes[BD_ATTRIBUTE_MAX],
                           const struct bd_seen *seen, const struct bd_scene_draw *draw)
{
    for (uint32_t s = 0; s < BD_STREAM_COUNT; s++) {
        if (!draw->primitive->has[s]) continue;
        attributes[s] = (struct bd_attribute){
            .buf = draw->mesh->vertices,
            .offset_bytes = draw->primitive->offset_bytes[s],
            .stride_bytes = bd_stream_component_count[s] * (uint32_t)sizeof(float),
            .component_count = bd_stream_component_count[s],
        };
    }
    attributes[BD_STREAM_COUNT] = (struct bd_attribute){
        .buf = seen->attribute,
        .stride_bytes = BD_INSTANCE_ATTRIBUTES * sizeof(uint32_t),
        .component_count = BD_INSTANCE_ATTRIBUTES,
        .is_uint = true,
        .per_instance = true,
    };
}

// What a viewpoint sees of the scene, and how it is drawn.
struct seen_scene {
    struct bd_view view;
    struct bd_seen seen;
    struct bd_scene_spans spans;
    struct bd_buf *list_indices, *list; // of spans that are listed; or NULL
};

// Where the triangles of a part of a draw are.
static void set_triangles(const struct seen_scene *seen, const struct bd_scene_span *span,
                          const struct bd_scene_draw *draw, uint32_t first_triangle,
                          struct bd_draw *call, struct bd_material_uniform *material)
{
    call->index_offset_bytes = 3 * sizeof(uint32_t) * (size_t)first_triangle;
    if (span->is_listed) {
        call->indices = seen->list_indices;
        material->triangle_list = first_triangle;
        call->bindings.arrays[BD_UNIT_TRIANGLE_LIST] = seen->list;
        return;
    }
    call->indices = draw->mesh->indices;
    call->index_offset_bytes += draw->primitive->index_offset_bytes;
    material->first_triangle += first_triangle;
}

static enum bd_err record_part(struct bd_gpu *gpu, const struct bd_scene_draws *draws,
                               const struct seen_scene *seen, const struct bd_scene_span *span,
                               const struct bd_scene_part *part, struct bd_err_detail *detail)
{
    const struct bd_scene_draw *draw = &draws->scene->draws[span->run];
    struct bd_program_source source = {
        .vertex = "pass/gbuffer/scene.vert",
        .fragment = draws->fragment,
        .defines = bd_material_defines(draws, draw),
    };
    struct bd_material_uniform material = bd_material_uniform_of(draws, draw);
    struct bd_draw call = {
        .index_count = 3 * part->triangle_count,
        .instance_count = part->instance_count,
        .base_instance = span->first_instance + part->first_instance,
        .mirrored = draw->run->mirrored,
    };
    if (span->is_listed) bd_define(&source.defines, "BD_TRIANGLE_LIST", 1);
    enum bd_err err = bd_program_get(gpu, &source, (struct bd_program **)&call.program, detail);
    if (err) return err;
    set_triangles(seen, span, draw, span->first_triangle + part->first_triangle, &call, &material);
    if (draws->cull_single_sided && !draw->material->double_sided) call.cull = BD_CULL_BACK;
    call.bindings.arrays[BD_UNIT_INSTANCES] = seen->seen.array;
    call.bindings.arrays[BD_UNIT_SURFACE_TRIANGLES] = draws->scene->triangles;
    call.bindings.uniforms[BD_UNIFORM_VIEW].bytes = &seen->view;
    call.bindings.uniforms[BD_UNIFORM_VIEW].size_bytes = sizeof seen->view;
    call.bindings.uniforms[BD_UNIFORM_MATERIAL].bytes = &material;
    call.bindings.uniforms[BD_UNIFORM_MATERIAL].size_bytes = sizeof material;
    bd_material_bind_maps(&call.bindings, draws->scene, draw->material);
    set_attributes(call.attributes, &seen->seen, draw);
    bd_gpu_draw(gpu, &call);
    return BD_ERR_OK;
}

static double part_triangles(const struct bd_scene_part *part)
{
    return (double)part->triangle_count * part->instance_count;
}

static double triangle_units(double triangles)
{
    return UNITS_PER_DRAW + UNITS_PER_TRIANGLE * triangles;
}

static double units_per_pixel(const struct bd_scene_draws *draws)
{
    return draws->surface ? UNITS_PER_SURFACE_PIXEL : UNITS_PER_ID_PIXEL;
}

static double all_triangle_units(const struct bd_scene_spans *spans)
{
    double units = 0;
    for (uint32_t s = 0; s < spans->count; s++)
        units +=
            triangle_units((double)spans->spans[s].triangle_count * spans->spans[s].instance_count);
    return units;
}

static const char *kind_of(const struct bd_scene_draws *draws, double per_unit)
{
    const bool by_pixels = per_unit > 2;
    if (draws->surface) return by_pixels ? "draws surface" : "draws surface triangles";
    return by_pixels ? "draws ids" : "draws id triangles";
}

// A band of rows that is drawn, and its current slice.
struct band {
    struct bd_slicer *slicer;
    double units_per_unit;   // pixels included: they are spread evenly over the triangles, for want
                             // of better knowledge
    double units, triangles; // in the slice so far
    double triangles_first, triangles_max; // that a slice may hold: at least, and this one
};

static struct band begin_band(const struct bd_scene_draws *draws,
                              const struct bd_scene_spans *spans, uint32_t rows,
                              struct bd_slicer *slicer)
{
    double pixel_units = units_per_pixel(draws) * draws->viewpoint->width_px * rows;
    struct band band = {.slicer = slicer};
    band.units_per_unit = 1 + pixel_units / fmax(all_triangle_units(spans), 1);
    // Triangles and pixels have paces of their own.
    bd_slicer_work(slicer, kind_of(draws, band.units_per_unit));
    double worst_units = UNITS_PER_TRIANGLE + pixel_units;
    band.triangles_first = fmax(SLICES_AT_WORST * bd_slicer_units(slicer) / worst_units, 1);
    band.triangles_max = band.triangles_first;
    return band;
}

static enum bd_err end_slice(struct band *band)
{
    enum bd_err err = bd_slicer_checkpoint(band->slicer, band->units);
    double growth = fmin(1 / fmax(band->slicer->last_share, 1e-3), SLICE_GROWTH);
    band->triangles_max = fmax(band->triangles * growth, band->triangles_first);
    band->units = band->triangles = 0;
    return err;
}

static bool is_slice_full(const struct band *band)
{
    return band->units >= bd_slicer_units(band->slicer) || band->triangles >= band->triangles_max ||
           bd_slicer_is_over(band->slicer);
}

// Triangles of the next part: what the slice has left, and no more than is expected to take a part
// of its time.
static double part_triangles_max(const struct band *band)
{
    double expected = bd_slicer_units(band->slicer) / PARTS_PER_SLICE /
                      (UNITS_PER_TRIANGLE * band->units_per_unit);
    return fmax(fmin(expected, band->triangles_max - band->triangles), 1);
}

static enum bd_err record_band(struct bd_gpu *gpu, const struct bd_scene_draws *draws,
                               const struct seen_scene *seen, uint32_t rows,
                               struct bd_slicer *slicer, struct bd_err_detail *detail)
{
    struct band band = begin_band(draws, &seen->spans, rows, slicer);
    for (uint32_t s = 0; s < seen->spans.count; s++) {
        const struct bd_scene_span *span = &seen->spans.spans[s];
        struct bd_scene_part part = {0};
        while (bd_scene_part_next(span->triangle_count, span->instance_count,
                                  part_triangles_max(&band), &part)) {
            enum bd_err err = record_part(gpu, draws, seen, span, &part, detail);
            band.triangles += part_triangles(&part);
            band.units += triangle_units(part_triangles(&part)) * band.units_per_unit;
            if (!err && is_slice_full(&band)) err = end_slice(&band);
            if (err) return err;
        }
    }
    return end_slice(&band);
}

static uint32_t band_rows(const struct bd_scene_draws *draws, const struct bd_scene_spans *spans,
                          struct bd_slicer *slicer, uint32_t rows_left)
{
    double units_per_row = units_per_pixel(draws) * draws->viewpoint->width_px;
    double units = PIXELS_PER_TRIANGLE_COST * all_triangle_units(spans);
    double units_max = BAND_SLICES_MAX * bd_slicer_units(slicer);
    double rows_min = (units < units_max ? units : units_max) / units_per_row;
    if (rows_min >= rows_left) return rows_left;
    uint32_t rows = bd_slicer_rows(slicer, units_per_row, rows_left);
    return rows > (uint32_t)rows_min ? rows : (uint32_t)rows_min + 1;
}

// Where triangles outnumber pixels, few of them cover a sample.
static bool is_worth_sieving(struct bd_gpu *gpu, const struct bd_scene_draws *draws,
                             const struct bd_scene_spans *spans)
{
    const double pixels = (double)draws->viewpoint->width_px * draws->viewpoint->height_px;
    const double count = bd_scene_spans_triangles(spans);
    return bd_gpu_caps(gpu)->software && count > SIEVED_LEAST && count > SIEVED_PER_PIXEL * pixels;
}

static enum bd_err sieve(struct bd_gpu *gpu, const struct bd_scene_draws *draws,
                         struct bd_slicer *slicer, struct seen_scene *to,
                         struct bd_err_detail *detail)
{
    enum bd_err err = bd_scene_spans_sieve(&to->spans, draws->scene, draws->viewpoint, &to->seen,
                                           bd_slicer_pause, slicer);
    const size_t count = to->spans.listed, vec4s = (count + 3) / 4;
    if (err || count == 0) return err;
    err = bd_buf_create(gpu, "listed indices", 3 * count * sizeof *to->spans.index, to->spans.index,
                        &to->list_indices, detail);
    if (err) return err;
    return bd_buf_create(gpu, "listed triangles", 4 * vec4s * sizeof *to->spans.number,
                         to->spans.number, &to->list, detail);
}

static enum bd_err look(struct bd_gpu *gpu, const struct bd_scene_draws *draws,
                        struct bd_slicer *slicer, struct seen_scene *to,
                        struct bd_err_detail *detail)
{
    to->view = bd_viewpoint_uniform(draws->viewpoint, &draws->scene->space);
    enum bd_err err = bd_seen_init(&to->seen, gpu, draws->scene, draws->viewpoint, bd_slicer_pause,
                                   slicer, detail);
    if (err) return err;
    err = bd_scene_spans_init(&to->spans, draws->scene, draws->viewpoint, &to->seen,
                              bd_slicer_pause, slicer);
    if (err || !is_worth_sieving(gpu, draws, &to->spans)) return err;
    return sieve(gpu, draws, slicer, to, detail);
}

enum bd_err bd_scene_draws_record(struct bd_gpu *gpu, const struct bd_scene_draws *draws,
                                  struct bd_slicer *slicer, struct bd_err_detail *detail)
{
    const uint32_t height = draws->viewpoint->height_px;
    struct seen_scene seen = {0};
    if (draws->tracer) return bd_scene_points_record(gpu, draws, slicer, detail);
    bd_slicer_work(slicer, draws->surface ? "draws surface" : "draws ids");
    enum bd_err err = look(gpu, draws, slicer, &seen, detail);
    // Of a view of nothing the target's clearing is all.
    for (uint32_t row = 0; !err && seen.spans.count && row < height;) {
        uint32_t rows = band_rows(draws, &seen.spans, slicer, height - row);
        bd_gpu_target_rows(gpu, row, rows);
        err = record_band(gpu, draws, &seen, rows, slicer, detail);
        row += rows;
    }
    bd_buf_destroy(gpu, &seen.list_indices);
    bd_buf_destroy(gpu, &seen.list);
    bd_scene_spans_finish(&seen.spans);
    bd_seen_finish(&seen.seen, gpu);
    return err;
}
