#include "pass/light_patches.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "kernel/all_channels.h"
#include "kernel/morton.h"
#include "lights/sequence.h"

#define AXES 6 // of the position, and of the normal
// Dividing fewer takes a fraction of a millisecond.
#define POINTS_TO_PAUSE 2048u
// Of all patches those that are kept for what lies apart from the rest of its own.
#define SPARE_PART 8u
// Of one patch: a scene may have thousands that lie apart, as leaves do, in what little flux it
// has.
#define PARTS_MOST 8u

// Points that are lit, one patch's side by side once they are divided.
struct lit_point {
    float axis[AXES];
    f3 flux;      // that it sends on
    float weight; // its strongest channel
    uint32_t point;
};

struct dividing {
    const struct bd_light_patches_inputs *inputs;
    struct lit_point *lit;
    struct bd_light_patches *patches;
    uint32_t spare, spare_end; // numbers that are kept for what lies apart
    enum bd_err err;           // of a pause
};

static double weight_of(const struct lit_point *lit, uint32_t count)
{
    double sum = 0;
    for (uint32_t i = 0; i < count; i++) sum += lit[i].weight;
    return sum;
}

// The axis along which they differ most. That they face apart counts as the way across them all:
// what is not one surface is divided first.
static int widest_axis(const struct lit_point *lit, uint32_t count, float *middle)
{
    float least[AXES], most[AXES], across = 0;
    int widest = 0;
    for (int a = 0; a < AXES; a++) least[a] = most[a] = lit[0].axis[a];
    for (uint32_t i = 1; i < count; i++)
        for (int a = 0; a < AXES; a++) {
            least[a] = f_min(least[a], lit[i].axis[a]);
            most[a] = f_max(most[a], lit[i].axis[a]);
        }
    for (int a = 0; a < 3; a++) across += (most[a] - least[a]) * (most[a] - least[a]);
    for (int a = 1; a < AXES; a++) {
        const float scale = a < 3 ? 1 : f_sqrt(across), of_widest = widest < 3 ? 1 : f_sqrt(across);
        if (scale * (most[a] - least[a]) > of_widest * (most[widest] - least[widest])) widest = a;
    }
    *middle = 0.5f * (least[widest] + most[widest]);
    return widest;
}

static bool is_before(const struct lit_point *a, const struct lit_point *b, int axis)
{
    return a->axis[axis] != b->axis[axis] ? a->axis[axis] < b->axis[axis] : a->point < b->point;
}

static void swap(struct lit_point *a, struct lit_point *b)
{
    const struct lit_point was = *a;
    *a = *b;
    *b = was;
}

// Those before the one at `pivot` go to the front; where that one comes to lie.
static uint32_t part_at(struct lit_point *lit, uint32_t count, int axis, uint32_t pivot)
{
    uint32_t at = 0;
    swap(&lit[pivot], &lit[count - 1]);
    for (uint32_t i = 0; i + 1 < count; i++)
        if (is_before(&lit[i], &lit[count - 1], axis)) swap(&lit[i], &lit[at++]);
    swap(&lit[at], &lit[count - 1]);
    return at;
}

// How many come first along the axis until they have `share` of the weight; they are put there
// (Hoare 1961, by weight).
static uint32_t part_by_weight(struct lit_point *lit, uint32_t count, int axis, double share)
{
    double wanted = share * weight_of(lit, count);
    uint32_t first = 0, left = count;
    while (left > 1) {
        // By no place that a scene could be made for.
        const uint32_t at = part_at(lit + first, left, axis, bd_stirred(left ^ first << 16) % left);
        const double before = weight_of(lit + first, at);
        if (wanted < before) {
            left = at;
        } else {
            wanted -= before + lit[first + at].weight;
            if (wanted <= 0) return first + at + 1;
            first += at + 1;
            left -= at + 1;
        }
    }
    return first + left;
}

static uint32_t part_by_value(struct lit_point *lit, uint32_t count, int axis, float middle)
{
    uint32_t at = 0;
    for (uint32_t i = 0; i < count; i++)
        if (lit[i].axis[axis] < middle) swap(&lit[i], &lit[at++]);
    return at;
}

static uint32_t held(uint32_t number, uint32_t most)
{
    return number < 1 ? 1 : number < most ? number : most;
}

// --- a patch ------------------------------------------------------------------------------------

static struct bd_vec4 vec4_of(f3 v, float w)
{
    return (struct bd_vec4){v.x, v.y, v.z, w};
}

static f3 place_of_lit(const struct lit_point *lit)
{
    return f3_of(lit->axis[0], lit->axis[1], lit->axis[2]);
}

// A patch's points lie within so many radii of a disk of their area. What lies farther off in its
// plane is another room's floor: the mean of both would put the light of one into the other.
#define RADII 4.0f

static float reach2_of(const struct bd_surface_points *spread, uint32_t count)
{
    return RADII * RADII * (float)count * spread->area / F_PI;
}

static bool is_on_surface(f3 normal, f3 other, f3 away, float reach2)
{
    return f3_dot(normal, other) > 0.9f && f3_dot(away, away) <= reach2 &&
           f_abs(f3_dot(normal, away)) <= 0.1f * f3_length(away) + 1e-6f;
}

static bool is_on_surface_of(const struct bd_surface_points *spread, const struct lit_point *one,
                             const struct lit_point *other, float reach2)
{
    return is_on_surface(spread->points[one->point].normal, spread->points[other->point].normal,
                         f3_sub(place_of_lit(other), place_of_lit(one)), reach2);
}

// A point as likely as what it sends, by the patch's number: of a patch that has several surfaces
// none is heard more often than it sends.
static const struct lit_point *chosen_of(const struct lit_point *lit, uint32_t count,
                                         uint32_t number)
{
    double wanted = (bd_stirred(number) + 0.5) * 0x1p-32 * weight_of(lit, count);
    for (uint32_t i = 0; i + 1 < count; i++)
        if ((wanted -= lit[i].weight) < 0) return &lit[i];
    return &lit[count - 1];
}

// On the surface of one that is chosen, the point that is nearest to their mean by weight; of
// equals the first.
static const struct lit_point *representative_of(const struct bd_surface_points *spread,
                                                 const struct lit_point *lit, uint32_t count,
                                                 uint32_t number)
{
    const struct lit_point *chosen = chosen_of(lit, count, number), *found = chosen;
    const float reach2 = reach2_of(spread, count);
    f3 sum = f3_of(0, 0, 0);
    float all = 0, nearest = INFINITY;
    for (uint32_t i = 0; i < count; i++) {
        if (!is_on_surface_of(spread, chosen, &lit[i], reach2)) continue;
        const f3 away = f3_sub(place_of_lit(&lit[i]), place_of_lit(chosen));
        sum = f3_add(sum, f3_scale(away, lit[i].weight));
        all += lit[i].weight;
    }
    const f3 mean = f3_add(place_of_lit(chosen), f3_scale(sum, 1 / all));
    for (uint32_t i = 0; i < count; i++) {
        const f3 d = f3_sub(place_of_lit(&lit[i]), mean);
        const float d2 = f3_dot(d, d);
        if (!is_on_surface_of(spread, chosen, &lit[i], reach2)) continue;
        if (d2 < nearest || (d2 == nearest && lit[i].point < found->point)) found = &lit[i];
        nearest = f_min(nearest, d2);
    }
    return found;
}

// Of the points that lie on the representative's surface.
struct patch {
    f3 normal, u, v; // u and v: unit, in its plane
    f3 offset;       // of their mean from the representative, in the plane
    float along, across;
    float area;
};

// Along the coordinate axes, as they were divided.
static void set_plane(struct patch *patch, f3 normal)
{
    const f3 n = normal, axis = f_abs(n.x) < 0.6f   ? f3_of(1, 0, 0)
                                : f_abs(n.y) < 0.6f ? f3_of(0, 1, 0)
                                                    : f3_of(0, 0, 1);
    patch->normal = n;
    patch->v = f3_unit(f3_cross(n, axis));
    patch->u = f3_cross(patch->v, n);
}

static struct patch patch_of(const struct bd_surface_points *spread, const struct lit_point *lit,
                             uint32_t count, const struct lit_point *representative)
{
    const struct bd_surface_point *points = spread->points;
    struct patch patch;
    double mean[2] = {0}, square[2] = {0}, sum = 0;
    const float reach2 = reach2_of(spread, count);
    uint32_t on_surface = 0;
    set_plane(&patch, points[representative->point].normal);
    for (uint32_t i = 0; i < count; i++) {
        const f3 away = f3_sub(place_of_lit(&lit[i]), place_of_lit(representative));
        if (!is_on_surface(patch.normal, points[lit[i].point].normal, away, reach2)) continue;
        const double at[2] = {f3_dot(away, patch.u), f3_dot(away, patch.v)};
        for (int a = 0; a < 2; a++) {
            mean[a] += at[a] * lit[i].weight;
            square[a] += at[a] * at[a] * lit[i].weight;
        }
        sum += lit[i].weight;
        on_surface++;
    }
    for (int a = 0; a < 2; a++) {
        mean[a] /= sum;
        square[a] = fmax(square[a] / sum - mean[a] * mean[a], 0);
    }
    patch.area = (float)on_surface * spread->area;
    patch.offset = f3_add(f3_scale(patch.u, (float)mean[0]), f3_scale(patch.v, (float)mean[1]));
    // As long against its width as they lie; no more than eight times, which few points might.
    const double ratio = sqrt((square[0] + 1e-12) / (square[1] + 1e-12));
    const float aspect = (float)fmin(fmax(ratio, 0.125), 8);
    patch.along = 0.5f * f_sqrt(patch.area * aspect);
    patch.across = 0.5f * f_sqrt(patch.area / aspect);
    return patch;
}

// Leaves of a tree lie in its grid along the curve in which they were divided.
static uint32_t place_of(const struct bd_light_patches_inputs *inputs, uint32_t number)
{
    if (inputs->root_side == 0) return number;
    const uint32_t side = (uint32_t)lround(sqrt(inputs->count));
    return every_second_bit(number >> 1) * side + every_second_bit(number);
}

// Those on the surface of one that is chosen go to the front; how many they are.
static uint32_t part_surfaces(const struct bd_surface_points *spread, struct lit_point *lit,
                              uint32_t count, uint32_t number)
{
    const struct lit_point chosen = *chosen_of(lit, count, number);
    const float reach2 = reach2_of(spread, count);
    uint32_t at = 0;
    for (uint32_t i = 0; i < count; i++)
        if (is_on_surface_of(spread, &chosen, &lit[i], reach2)) swap(&lit[i], &lit[at++]);
    return at;
}

static void put_patch(struct dividing *d, const struct lit_point *lit, uint32_t count,
                      uint32_t number)
{
    const struct bd_light_patches_inputs *in = d->inputs;
    struct bd_light_patches *out = d->patches;
    const struct lit_point *representative = representative_of(in->points, lit, count, number);
    const struct patch patch = patch_of(in->points, lit, count, representative);
    const f3 u = f3_scale(patch.u, patch.along), v = f3_scale(patch.v, patch.across);
    const float near = in->kernel == BD_KERNEL_PATCH ? (float)in->near_field : 0;
    const float longer = f_max(patch.along, patch.across);
    const float reach2 = f_max(patch.area / F_PI, longer * longer);
    const float kernel_area = in->kernel == BD_KERNEL_POINT ? 0 : patch.area;
    const uint32_t at = place_of(in, number);
    f3 flux = f3_of(0, 0, 0);
    for (uint32_t i = 0; i < count; i++) {
        flux = f3_add(flux, lit[i].flux);
        out->flux += (double)strongest_channel(in->irradiance[lit[i].point]) * in->points->area;
    }
    const f3 position = f3_add(place_of_lit(representative), patch.offset);
    out->area += patch.area;
    out->lights[at][0] = vec4_of(position, kernel_area);
    out->lights[at][1] = vec4_of(patch.normal, near * near * reach2);
    out->lights[at][2] = vec4_of(flux, f3_dot(patch.offset, patch.u) / patch.along);
    out->quads[at][0] = vec4_of(u, 1 / patch.area);
    out->quads[at][1] = vec4_of(v, f3_dot(patch.offset, patch.v) / patch.across);
}

// Where light comes through a slit, the little there is beyond would have a part of a patch, and be
// nothing or several times too much: parts that lie apart are patches of their own.
static void put_parts(struct dividing *d, struct lit_point *lit, uint32_t count, uint32_t number)
{
    for (uint32_t parts = 1; parts < PARTS_MOST && d->spare < d->spare_end; parts++) {
        const uint32_t together = part_surfaces(d->inputs->points, lit, count, number);
        if (together == count) break;
        put_patch(d, lit, together, number);
        lit += together;
        count -= together;
        number = d->spare++;
    }
    put_patch(d, lit, count, number);
}

// Into so many patches of about equal flux, the first of which has that number.
static void divide(struct dividing *d, struct lit_point *lit, uint32_t count, uint32_t patches,
                   uint32_t number)
{
    float middle;
    if (count >= POINTS_TO_PAUSE && !d->err) d->err = bd_slicer_pause(d->inputs->slicer);
    if (count == 0 || d->err) return;
    if (patches == 1 || count == 1) {
        put_parts(d, lit, count, number);
        return;
    }
    const int axis = widest_axis(lit, count, &middle);
    uint32_t first = patches / 2, part;
    if (axis < 3) {
        part = held(part_by_weight(lit, count, axis, (double)first / patches), count - 1);
    } else {
        part = held(part_by_value(lit, count, axis, middle), count - 1);
        first = held((uint32_t)lround(patches * weight_of(lit, part) / weight_of(lit, count)),
                     patches - 1);
    }
    divide(d, lit, part, first, number);
    divide(d, lit + part, count - part, patches - first, number + first);
}

static uint32_t list_lit(const struct bd_light_patches_inputs *in, struct lit_point *lit)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < in->points->count; i++) {
        const struct bd_surface_point *point = &in->points->points[i];
        const f3 at = point->position, n = point->normal;
        const f3 flux = f3_scale(f3_mul(point->diffuse, in->irradiance[i]), in->points->area);
        const float weight = strongest_channel(flux);
        if (weight > 0)
            lit[count++] = (struct lit_point){{at.x, at.y, at.z, n.x, n.y, n.z}, flux, weight, i};
    }
    return count;
}

enum bd_err bd_light_patches_init(struct bd_light_patches *patches,
                                  const struct bd_light_patches_inputs *inputs,
                                  struct bd_err_detail *detail)
{
    const uint32_t count = inputs->count;
    const uint32_t spare = inputs->root_side == 0 ? count / SPARE_PART : 0;
    *patches = (struct bd_light_patches){.lights = calloc(count, sizeof *patches->lights),
                                         .quads = calloc(count, sizeof *patches->quads)};
    struct dividing d = {.inputs = inputs,
                         .lit = malloc((inputs->points->count + 1) * sizeof *d.lit),
                         .patches = patches,
                         .spare = count - spare,
                         .spare_end = count};
    if (!d.lit || !patches->lights || !patches->quads)
        d.err = bd_err_set(detail, BD_ERR_NO_MEMORY, "vpls", "no memory for %u light paths", count);
    bd_slicer_work(inputs->slicer, "divide");
    if (!d.err) divide(&d, d.lit, list_lit(inputs, d.lit), count - spare, 0);
    free(d.lit);
    if (d.err) bd_light_patches_finish(patches);
    return d.err;
}

void bd_light_patches_finish(struct bd_light_patches *patches)
{
    free(patches->lights);
    free(patches->quads);
    *patches = (struct bd_light_patches){0};
}
