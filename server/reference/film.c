#include "reference/film.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "base/assert.h"
#include "reference/path.h"

// Of the reference's unit: what is smaller is rounded, what is larger is held.
#define STEPS_PER_UNIT 0x1p30
#define MOST_STEPS     0x1p52

struct film_pixel {
    _Atomic int64_t sum[2][3], squares[3];
};

struct bd_film {
    const struct bd_reference *reference;
    struct bd_integrand integrand;
    struct bd_reference_view view;
    uint32_t region[4];
    double steps_per_cd_m2, steps_per_square;
    struct film_pixel *pixels;
};

enum bd_err bd_film_create(const struct bd_reference *reference,
                           const struct bd_integrand *integrand,
                           const struct bd_reference_view *view, const uint32_t region[4],
                           struct bd_film **out, struct bd_err_detail *detail)
{
    const size_t pixels = (size_t)region[2] * region[3];
    const double unit = reference->unit_cd_m2;
    struct bd_film *film = *out = calloc(1, sizeof *film);
    BD_ASSERT(film);
    *film = (struct bd_film){
        .reference = reference,
        .integrand = *integrand,
        .view = *view,
        .region = {region[0], region[1], region[2], region[3]},
        .steps_per_cd_m2 = STEPS_PER_UNIT / unit,
        .steps_per_square = STEPS_PER_UNIT / (unit * unit),
        .pixels = calloc(pixels, sizeof *film->pixels),
    };
    if (film->pixels) return BD_ERR_OK;
    bd_film_destroy(out);
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "size", "no memory for the light of %zu pixels",
                      pixels);
}

void bd_film_destroy(struct bd_film **film)
{
    if (!*film) return;
    free((*film)->pixels);
    free(*film);
    *film = NULL;
}

// --- tracing ------------------------------------------------------------------------------------

struct landing {
    struct bd_film *film;
    uint32_t half;
};

static void add(_Atomic int64_t *sum, double steps)
{
    if (isfinite(steps))
        atomic_fetch_add_explicit(sum, (int64_t)llrint(fmin(steps, MOST_STEPS)),
                                  memory_order_relaxed);
}

static void land(void *user, uint32_t x_px, uint32_t y_px, const double cd_m2[3])
{
    const struct landing *landing = user;
    struct bd_film *film = landing->film;
    const uint32_t x = x_px - film->region[0], y = y_px - film->region[1];
    if (x_px < film->region[0] || y_px < film->region[1] || x >= film->region[2] ||
        y >= film->region[3])
        return;
    struct film_pixel *pixel = &film->pixels[(size_t)y * film->region[2] + x];
    const double paths = (double)film->view.width_px * film->view.height_px;
    for (int k = 0; k < 3; k++) {
        const double value = cd_m2[k] / paths;
        add(&pixel->sum[landing->half][k], value * film->steps_per_cd_m2);
        add(&pixel->squares[k], value * value * film->steps_per_square);
    }
}

void bd_film_trace(struct bd_film *film, uint64_t seed, uint32_t first_sample, uint64_t first_path,
                   uint32_t count)
{
    const uint64_t paths = (uint64_t)film->view.width_px * film->view.height_px;
    for (uint64_t i = first_path; i < first_path + count; i++) {
        struct landing landing = {film, (uint32_t)(i / paths % 2)};
        bd_reference_light_path(film->reference, &film->integrand, &film->view, seed, landing.half,
                                first_sample + (uint32_t)(i / paths / 2), i % paths, land,
                                &landing);
    }
}

void bd_film_take(struct bd_film *film, uint32_t x_px, uint32_t y_px,
                  struct bd_reference_pixel *pixel)
{
    const size_t at = (size_t)(y_px - film->region[1]) * film->region[2] + x_px - film->region[0];
    struct film_pixel *from = &film->pixels[at];
    for (int k = 0; k < 3; k++) {
        for (int half = 0; half < 2; half++)
            pixel->landed[half][k] +=
                (double)atomic_exchange(&from->sum[half][k], 0) / film->steps_per_cd_m2;
        pixel->landed_square_sum[k] +=
            (double)atomic_exchange(&from->squares[k], 0) / film->steps_per_square;
    }
}
