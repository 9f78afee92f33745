#include "lights/emitter_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "kernel/all_channels.h"
#include "lights/map.h"

#define LEVELS_MAX  16u // two bits of a path each
#define PAUSE_EVERY 16u // parts, of 4,096 texels at most
// Where alpha cuts parts out, nothing tells where: so many levels.
#define LEVELS_OF_ALPHA 3u
// A part is even where it is nowhere so many times as bright as in the mean.
#define EVEN_MOST 3.0f
// A triangle that a map repeats over as often is as bright as the map's mean, and would take all
// the room.
#define SIDE_TEXELS_MOST 1e6f
// Of a part, along a side: where its map is looked at for its mean.
#define LOOKS 2u
// Of what its texels tell, where alpha leaves nothing of a part at any of those places.
#define ABSENT_SHARE 0.02f

// --- what a map shows ---------------------------------------------------------------------------

static const struct bd_material *material_of(const struct bd_area_lights *lights,
                                             const struct bd_area_source *source)
{
    return &lights->scene->materials[source->primitive->material];
}

static struct bd_map_range range_of(const struct bd_area_lights *lights,
                                    const struct bd_area_light *part)
{
    const struct bd_area_source *source = &lights->sources[part->source];
    const uint32_t *index =
        source->primitive->index + 3 * (size_t)(part->triangle - source->first_triangle);
    return bd_map_range(lights->scene, &material_of(lights, source)->emissive_map,
                        source->primitive, index, part->u, part->v);
}

// Of the middles of equal parts.
static float mean_of_looks(const struct bd_area_lights *lights, const struct bd_area_light *part,
                           uint32_t looks)
{
    float sum = 0;
    for (uint32_t i = 0; i < looks; i++)
        for (uint32_t j = 0; j < 2 * (looks - i) - 1; j++) {
            const float third = j % 2 ? 2.0f / 3 : 1.0f / 3;
            const float s = ((float)(j / 2) + third) / (float)looks;
            const float t = ((float)i + third) / (float)looks;
            const float u =
                part->u[0] + s * (part->u[1] - part->u[0]) + t * (part->u[2] - part->u[0]);
            const float v =
                part->v[0] + s * (part->v[1] - part->v[0]) + t * (part->v[2] - part->v[0]);
            sum += strongest_channel(bd_area_emission_chosen(lights, part, u, v, part->normal));
        }
    return sum / (float)(looks * looks);
}

// Looks miss texels, and those of the part's box are not all its own: half of either.
float bd_emitter_part_brightness(const struct bd_area_lights *lights,
                                 const struct bd_area_light *part)
{
    const struct bd_area_source *source = &lights->sources[part->source];
    const float *factor = material_of(lights, source)->emissive;
    if (!source->has_map && !source->has_alpha) return mean_of_looks(lights, part, 1);
    const struct bd_map_range range = range_of(lights, part);
    const float of_map = strongest_channel(f3_of(factor[0], factor[1], factor[2])) *
                         (range.is_told ? range.mean : 1);
    const float of_looks = mean_of_looks(lights, part, LOOKS);
    const bool is_absent = source->has_alpha && !(of_looks > 0);
    return 0.5f * (of_looks + (is_absent ? ABSENT_SHARE : 1) * of_map);
}

// --- splitting ----------------------------------------------------------------------------------

enum part_state { IS_BLACK, IS_EVEN, IS_OPEN };

static enum part_state state_of(const struct bd_area_lights *lights,
                                const struct bd_area_light *part, uint32_t level)
{
    const struct bd_area_source *source = &lights->sources[part->source];
    const bool has_alpha = source->has_alpha && level < LEVELS_OF_ALPHA;
    if (!source->has_map) return has_alpha ? IS_OPEN : IS_EVEN;
    const struct bd_map_range range = range_of(lights, part);
    if (range.is_told && !(range.most > 0)) return IS_BLACK;
    if (level == LEVELS_MAX) return IS_EVEN;
    if (has_alpha) return IS_OPEN;
    const bool is_even = range.is_told && range.most <= EVEN_MOST * range.mean;
    const bool can_be_split = range.side_texels > 1 && range.side_texels < SIDE_TEXELS_MOST;
    return is_even || !can_be_split ? IS_EVEN : IS_OPEN;
}

// Of four: at the first, second and third corner, and the one between, turned round.
static struct bd_area_light child_of(const struct bd_area_light *part, uint32_t which,
                                     uint32_t level)
{
    static const uint8_t corners[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {4, 5, 3}};
    struct bd_area_light child = *part;
    child.area = part->area / 4;
    child.path |= which << (32 - 2 * level);
    for (int c = 0; c < 3; c++) {
        const uint32_t corner = corners[which][c], a = corner % 3, b = (corner + 1) % 3;
        const bool is_middle = corner >= 3;
        child.u[c] = is_middle ? 0.5f * (part->u[a] + part->u[b]) : part->u[a];
        child.v[c] = is_middle ? 0.5f * (part->v[a] + part->v[b]) : part->v[a];
        child.corner[c] =
            is_middle ? f3_scale(f3_add(part->corner[a], part->corner[b]), 0.5f) : part->corner[a];
    }
    return child;
}

uint32_t bd_emitter_path_of(float u, float v)
{
    uint32_t path = 0;
    for (uint32_t level = 1; level <= LEVELS_MAX; level++) {
        const uint32_t which = u + v < 0.5f ? 0 : u > 0.5f ? 1 : v > 0.5f ? 2 : 3;
        path |= which << (32 - 2 * level);
        u = which == 3 ? 1 - 2 * u : 2 * u - (which == 1 ? 1.0f : 0.0f);
        v = which == 3 ? 1 - 2 * v : 2 * v - (which == 2 ? 1.0f : 0.0f);
    }
    return path;
}

struct splitting {
    struct bd_area_lights *lights;
    uint8_t *states; // of each part
    uint32_t level;
    enum bd_err (*pause)(void *user);
    void *user;
};

static uint64_t count_open(const struct splitting *s)
{
    uint64_t open = 0;
    for (uint32_t i = 0; i < s->lights->count; i++) open += s->states[i] == IS_OPEN;
    return open;
}

// The first takes the place of the whole.
static void split(struct splitting *s, uint32_t at)
{
    struct bd_area_lights *lights = s->lights;
    const struct bd_area_light whole = lights->lights[at];
    s->states[at] = IS_BLACK;
    for (uint32_t which = 0; which < 4; which++) {
        const struct bd_area_light child = child_of(&whole, which, s->level);
        const enum part_state state = state_of(lights, &child, s->level);
        if (state == IS_BLACK) continue;
        const uint32_t to = s->states[at] == IS_BLACK ? at : lights->count++;
        lights->lights[to] = child;
        s->states[to] = (uint8_t)state;
    }
}

static enum bd_err split_level(struct splitting *s)
{
    const uint32_t count = s->lights->count;
    enum bd_err err = BD_ERR_OK;
    s->level++;
    for (uint32_t i = 0; !err && i < count; i++) {
        if (s->states[i] != IS_OPEN && i % PAUSE_EVERY != 0) continue;
        if (s->states[i] == IS_OPEN) split(s, i);
        err = s->pause(s->user);
    }
    return err;
}

static void leave_black_out(struct splitting *s)
{
    struct bd_area_lights *lights = s->lights;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < lights->count; i++)
        if (s->states[i] != IS_BLACK) lights->lights[kept++] = lights->lights[i];
    lights->count = kept;
}

static int by_place(const void *a, const void *b)
{
    const struct bd_area_light *one = a, *other = b;
    if (one->triangle != other->triangle) return one->triangle < other->triangle ? -1 : 1;
    return one->path < other->path ? -1 : one->path > other->path;
}

enum bd_err bd_emitter_parts_split(struct bd_area_lights *lights, uint32_t room,
                                   enum bd_err (*pause)(void *user), void *user)
{
    struct splitting s = {
        .lights = lights, .states = calloc((size_t)room + 1, 1), .pause = pause, .user = user};
    BD_ASSERT(s.states);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < lights->count; i++) {
        s.states[i] = (uint8_t)state_of(lights, &lights->lights[i], 0);
        if (i % PAUSE_EVERY == 0) err = pause(user);
    }
    uint64_t open = count_open(&s);
    for (; !err && open > 0 && lights->count + 3 * open <= room; open = count_open(&s))
        err = split_level(&s);
    if (!err) leave_black_out(&s);
    if (!err && s.level > 0) qsort(lights->lights, lights->count, sizeof *lights->lights, by_place);
    free(s.states);
    return err;
}
