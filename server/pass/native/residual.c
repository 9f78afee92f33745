// What a screen's parts give to a group of neighbouring pixels beyond the clamp: a walk from the
// coarsest level down, one for all lanes, each of which goes on or takes the part by itself.

#include "pass/native/loops.h"

#include <string.h>

#include "kernel/all_channels.h"
#include "kernel/brdf.h"
#include "kernel/residual.h"
#include "pass/native/lanes.h"

#define FEW_LANES(i) for (size_t i = 0; i < BD_SCREEN_LANES; i++)

// What lanes are at a part, and which of them go on to its children.
struct walk {
    const struct bd_native_screen *screen;
    const struct bd_screen_receivers *receivers;
    const struct bd_screen_surfaces *surfaces; // NULL: no lobe is asked for
    struct bd_screen_light *light;
    float share[BD_SCREEN_LANES]; // of the part that was looked at last: irradiance of a radiance
                                  // of 1
    float at[BD_SCREEN_LEVELS_MAX][BD_SCREEN_LANES]; // 1, or 0
};

// What is known where the loop is expanded: of a pixel; as printed.
struct kind {
    bool finest, printed;
};

static inline __attribute__((always_inline)) uint32_t
look(const struct bd_screen_receivers *restrict r, const struct bd_screen_part *restrict part,
     float clamp, float threshold, struct kind kind, const float *restrict at,
     float *restrict below, float *restrict shares, struct bd_screen_light *restrict light)
{
    const f3 middle = f3_from(&part->middle_area), normal = f3_from(&part->normal_radius);
    const f3 radiance = f3_from(&part->radiance_thickness);
    const float area = part->middle_area.w, radius = part->normal_radius.w;
    const float thickness = part->radiance_thickness.w;
    uint32_t any = 0;
    FEW_LANES(i)
    {
        const f3 n = f3_of(r->normal_x[i], r->normal_y[i], r->normal_z[i]);
        const f3 n_geometric = f3_of(r->geometric_x[i], r->geometric_y[i], r->geometric_z[i]);
        const f3 to = f3_sub(middle, f3_of(r->x[i], r->y[i], r->z[i]));
        const float r2 = f3_dot(to, to);
        const float most = kind.printed ? most_as_printed(n, to, r2, normal)
                                        : most_of_part(n, to, r2, normal, radius, thickness);
        const bool gives = b_and(most > (kind.printed ? -1.0f : clamp), at[i] > 0.0f);
        const float nearer = kind.printed ? -1.0f : NEAR_PIXELS * area - r2;
        const float excess = kind.finest ? nearer : most * area - threshold;
        const bool is_wide = excess > 0.0f;
        const bool wants = b_and(gives, is_wide);
        const float kernel = residual_light(n, n_geometric, to, r2, normal, area, clamp);
        const float share = f_select(b_and(gives, !wants), kernel, 0.0f);
        light->red[i] += share * radiance.x;
        light->green[i] += share * radiance.y;
        light->blue[i] += share * radiance.z;
        light->given[i] += share;
        light->looked[i] += at[i];
        shares[i] = share;
        below[i] = f_select(wants, 1.0f, 0.0f);
        any |= wants;
    }
    return any;
}

// A pixel's patch, or a part of it.
struct patch {
    f3 middle, u, v, radiance;
    float area, counts;
};

static inline __attribute__((always_inline)) void
look_near(const struct bd_screen_receivers *restrict r, const struct patch *restrict patch,
          float clamp, const float *restrict near, float *restrict shares,
          struct bd_screen_light *restrict light)
{
    const f3 middle = patch->middle, u = patch->u, v = patch->v, radiance = patch->radiance;
    const float area = patch->area, counts = patch->counts;
    FEW_LANES(i)
    {
        const f3 n = f3_of(r->normal_x[i], r->normal_y[i], r->normal_z[i]);
        const f3 n_geometric = f3_of(r->geometric_x[i], r->geometric_y[i], r->geometric_z[i]);
        const f3 to = f3_sub(middle, f3_of(r->x[i], r->y[i], r->z[i]));
        const float kernel = residual_patch(n, n_geometric, to, u, v, counts, area, clamp);
        const float share = f_select(near[i] > 0.0f, kernel, 0.0f);
        light->red[i] += share * radiance.x;
        light->green[i] += share * radiance.y;
        light->blue[i] += share * radiance.z;
        light->given[i] += share;
        shares[i] = share;
    }
}

// --- lobes --------------------------------------------------------------------------------------

static bool any_share(const struct walk *w)
{
    float most = 0;
    FEW_LANES(i) most = f_max(most, w->share[i] * w->surfaces->has_lobe[i]);
    return most > 0;
}

static inline __attribute__((always_inline)) void
reflect(const struct bd_screen_receivers *restrict r, const struct bd_screen_surfaces *restrict s,
        f3 middle, f3 radiance, const float *restrict shares,
        struct bd_screen_light *restrict light)
{
    FEW_LANES(i)
    {
        const f3 n = f3_of(r->normal_x[i], r->normal_y[i], r->normal_z[i]);
        const f3 to = f3_sub(middle, f3_of(r->x[i], r->y[i], r->z[i]));
        const f3 l = f3_scale(to, 1.0f / f_sqrt(f_max(f3_dot(to, to), 1e-24f)));
        const float share = shares[i] * s->has_lobe[i];
        const float over_sr = shares[i] / f_max(f3_dot(n, l), 1e-3f);
        const f3 beyond =
            beyond_diffuse(f3_of(s->red[i], s->green[i], s->blue[i]), s->metallic[i],
                           roughness_over(s->roughness[i], over_sr), s->f0_dielectric[i], n, l,
                           f3_of(s->viewer_x[i], s->viewer_y[i], s->viewer_z[i]));
        light->lobe_red[i] += share * radiance.x * beyond.x;
        light->lobe_green[i] += share * radiance.y * beyond.y;
        light->lobe_blue[i] += share * radiance.z * beyond.z;
        light->reflected[i] += share * strongest_channel(beyond);
    }
}

// What lobes make of the light that was just added.
static void add_lobes(struct walk *w, f3 middle, f3 radiance)
{
    if (w->surfaces && any_share(w))
        reflect(w->receivers, w->surfaces, middle, radiance, w->share, w->light);
}

// --- the walk -----------------------------------------------------------------------------------

// Adds a pixel to lanes that are so near that it is a patch.
static void add_patch(struct walk *w, uint32_t pixel, const float *near)
{
    const struct bd_screen_part *part = &w->screen->parts[pixel];
    const struct bd_screen_patch *own = &w->screen->patches[pixel];
    const float clamp = w->screen->args.clamp, area = part->middle_area.w;
    const f3 u = f3_from(&own->u_part), v = f3_from(&own->v), middle = f3_from(&part->middle_area);
    const uint32_t parts = parts_of_side(area, clamp);
    const float share = 1.0f / f_of(parts);
    struct patch patch = {.u = f3_scale(u, share),
                          .v = f3_scale(v, share),
                          .radiance = f3_from(&part->radiance_thickness),
                          .area = area * share * share,
                          .counts = own->u_part.w};
    for (uint32_t i = 0; i < parts * parts; i++) {
        const f3 across = f3_scale(u, middle_of_part(i % parts, parts));
        const f3 along = f3_scale(v, middle_of_part(i / parts, parts));
        patch.middle = f3_add(middle, f3_add(across, along));
        look_near(w->receivers, &patch, clamp, near, w->share, w->light);
        add_lobes(w, patch.middle, patch.radiance);
    }
}

// Of a part: whether any lane goes on, or is so near that a pixel is a patch to it.
static bool look_at(struct walk *w, const struct bd_screen_part *part, uint32_t level, float *below)
{
    const struct bd_screen_args *args = &w->screen->args;
    const bool is_edge = spans_edge(part->normal_radius.w, part->radiance_thickness.w);
    const float threshold = is_edge ? args->edge_sr : args->smooth_sr;
    uint32_t any;
#define LOOK(finest, printed)                                                                      \
    look(w->receivers, part, args->clamp, threshold, (struct kind){finest, printed}, w->at[level], \
         below, w->share, w->light)
    if (w->screen->printed)
        any = level == 0 ? LOOK(true, true) : LOOK(false, true);
    else
        any = level == 0 ? LOOK(true, false) : LOOK(false, false);
#undef LOOK
    add_lobes(w, f3_from(&part->middle_area), f3_from(&part->radiance_thickness));
    return any != 0;
}

static void visit_pixel(struct walk *w, uint32_t pixel)
{
    float near[BD_SCREEN_LANES];
    if (look_at(w, &w->screen->parts[pixel], 0, near)) add_patch(w, pixel, near);
}

static void visit(struct walk *w, uint32_t level, uint32_t x, uint32_t y)
{
    const struct bd_uvec4 *own = &w->screen->args.levels[level], *finer = own - 1;
    const uint32_t index = own->z + y * own->x + x;
    if (w->screen->parts[index].middle_area.w == 0) return;
    if (level == 0) {
        visit_pixel(w, index);
        return;
    }
    if (!look_at(w, &w->screen->parts[index], level, w->at[level - 1])) return;
    for (uint32_t v = 2 * y; v < 2 * y + 2 && v < finer->y; v++)
        for (uint32_t u = 2 * x; u < 2 * x + 2 && u < finer->x; u++) visit(w, level - 1, u, v);
}

static void hold(struct bd_screen_light *restrict light)
{
    FEW_LANES(i)
    {
        const float part = part_of_hemisphere(light->given[i]);
        light->red[i] *= part;
        light->green[i] *= part;
        light->blue[i] *= part;
        const float of_lobe = part * part_of_lobe(light->reflected[i]);
        light->lobe_red[i] *= of_lobe;
        light->lobe_green[i] *= of_lobe;
        light->lobe_blue[i] *= of_lobe;
    }
}

void WIDE(bd_native_residual)(const struct bd_native_screen *screen,
                              const struct bd_screen_receivers *receivers,
                              const struct bd_screen_surfaces *surfaces,
                              struct bd_screen_light *light)
{
    struct walk w = {
        .screen = screen, .receivers = receivers, .surfaces = surfaces, .light = light};
    const uint32_t top = screen->args.level_count - 1;
    const struct bd_uvec4 *bounds = &receivers->bounds;
    memcpy(w.at[top], receivers->lit, sizeof w.at[top]);
    for (uint32_t y = bounds->y; y < bounds->w; y++)
        for (uint32_t x = bounds->x; x < bounds->z; x++) visit(&w, top, x, y);
    if (!screen->printed) hold(light);
}
