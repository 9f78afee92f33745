#include "lights/punctual_tree.h"

#include <math.h>
#include <stdlib.h>

#include "base/assert.h"

#define PAUSE_EVERY 1024u
#define ANY_COSINE  (-1.0f)
#define NO_COSINE   2.0f
// Of a cone about two: what their angles lose by rounding.
#define ANGLE_SLACK 1e-4f
// Of tests that leave punctual lights out.
#define SLACK 1e-5f

static f3 f3_from(struct bd_vec4 v)
{
    return f3_of(v.x, v.y, v.z);
}

static float brightest(struct bd_vec4 rgb)
{
    return fmaxf(rgb.x, fmaxf(rgb.y, rgb.z));
}

static bool is_parallel(const struct bd_light_uniform *punctual)
{
    return punctual->kind == BD_LIGHT_KIND_DIRECTIONAL;
}

// --- bounds -------------------------------------------------------------------------------------

static struct bd_punctual_bound bound_of(const struct bd_light_uniform *punctual)
{
    if (is_parallel(punctual))
        return (struct bd_punctual_bound){.cosine = NO_COSINE,
                                          .even = brightest(punctual->intensity)};
    const bool is_cone = punctual->kind == BD_LIGHT_KIND_SPOT && punctual->cos_outer > ANY_COSINE;
    const float cosine = is_cone ? punctual->cos_outer : ANY_COSINE;
    return (struct bd_punctual_bound){
        .axis = f3_from(punctual->direction),
        .cosine = cosine,
        .sine = sqrtf(fmaxf(1 - cosine * cosine, 0)),
        .reach = punctual->inverse_range > 0 ? 1 / punctual->inverse_range : INFINITY,
    };
}

static void set_cone(struct bd_punctual_bound *bound, f3 axis, float angle)
{
    bound->axis = axis;
    bound->cosine = angle < F_PI ? cosf(angle) : ANY_COSINE;
    bound->sine = angle < F_PI ? sinf(angle) : 0;
}

static void copy_cone(struct bd_punctual_bound *to, const struct bd_punctual_bound *from)
{
    to->axis = from->axis;
    to->cosine = from->cosine;
    to->sine = from->sine;
}

// The smallest cone about both: that of the wider one, or one that turns from the one to the other.
static void join_cones(const struct bd_punctual_bound *a, const struct bd_punctual_bound *b,
                       struct bd_punctual_bound *out)
{
    const struct bd_punctual_bound *wide = a->cosine < b->cosine ? a : b,
                                   *other = wide == a ? b : a;
    copy_cone(out, wide);
    if (other->cosine == NO_COSINE || wide->cosine <= ANY_COSINE) return;
    const float between = acosf(fminf(fmaxf(f3_dot(wide->axis, other->axis), -1), 1));
    const float of_wide = acosf(wide->cosine), of_other = acosf(other->cosine);
    if (between + of_other <= of_wide) return;
    const float angle = 0.5f * (of_wide + of_other + between), turn = angle - of_wide;
    const float sine = sinf(between);
    if (!(sine > 1e-3f)) { // along one line: as wide as the wider one and what lies between
        set_cone(out, wide->axis, between + of_other + ANGLE_SLACK);
        return;
    }
    const f3 axis = f3_add(f3_scale(wide->axis, sinf(between - turn) / sine),
                           f3_scale(other->axis, sinf(turn) / sine));
    set_cone(out, f3_unit(axis), angle + ANGLE_SLACK);
}

static struct bd_punctual_bound joined(const struct bd_punctual_bound *a,
                                       const struct bd_punctual_bound *b)
{
    struct bd_punctual_bound both = {.reach = fmaxf(a->reach, b->reach), .even = a->even + b->even};
    join_cones(a, b, &both);
    return both;
}

static void set_box(struct bd_punctual_bound *bound, const struct bd_emitter_node *node)
{
    bound->half = f3_scale(f3_sub(node->most, node->least), 0.5f);
    bound->middle = f3_add(node->least, bound->half);
    bound->radius = f3_length(bound->half);
}

// --- making -------------------------------------------------------------------------------------

struct making {
    struct bd_punctual_tree *punctuals;
    enum bd_err (*pause)(void *user);
    void *user;
    uint32_t done;
    enum bd_err err;
};

static void rest(struct making *m)
{
    if (!m->err && ++m->done % PAUSE_EVERY == 0) m->err = m->pause(m->user);
}

static void bound_below(struct making *m, uint32_t node, uint32_t begin, uint32_t end)
{
    const struct bd_punctual_tree *punctuals = m->punctuals;
    struct bd_punctual_bound *bounds = punctuals->bounds;
    if (end - begin == 1) {
        bounds[node] = bound_of(&punctuals->punctuals[punctuals->tree.order[begin]]);
        rest(m);
    } else {
        const uint32_t middle = begin + (end - begin) / 2, second = node + 2 * (middle - begin);
        if (!m->err) bound_below(m, node + 1, begin, middle);
        if (!m->err) bound_below(m, second, middle, end);
        if (m->err) return;
        bounds[node] = joined(&bounds[node + 1], &bounds[second]);
    }
    set_box(&bounds[node], &punctuals->tree.nodes[node]);
}

static void make_leaves(struct making *m, struct bd_emitter_leaf *leaves)
{
    const struct bd_punctual_tree *punctuals = m->punctuals;
    for (uint32_t i = 0; !m->err && i < punctuals->count; i++) {
        const struct bd_light_uniform *punctual = &punctuals->punctuals[i];
        const f3 at = f3_from(punctual->position);
        const float flux = is_parallel(punctual) ? 0 : brightest(punctual->intensity);
        leaves[i] = (struct bd_emitter_leaf){bd_emitter_to_all_sides(at, at, flux), at};
        rest(m);
    }
}

static enum bd_err make(struct bd_punctual_tree *punctuals, enum bd_err (*pause)(void *user),
                        void *user, struct bd_err_detail *detail)
{
    struct making m = {.punctuals = punctuals, .pause = pause, .user = user};
    struct bd_emitter_leaf *leaves = malloc(punctuals->count * sizeof *leaves);
    punctuals->bounds = malloc((2 * (size_t)punctuals->count - 1) * sizeof *punctuals->bounds);
    if (!leaves || !punctuals->bounds)
        m.err = bd_err_set(detail, BD_ERR_NO_MEMORY, "scene",
                           "no memory for a tree of %u punctual lights", punctuals->count);
    if (!m.err) make_leaves(&m, leaves);
    if (!m.err)
        m.err =
            bd_emitter_tree_init(&punctuals->tree, leaves, punctuals->count, pause, user, detail);
    if (!m.err) bound_below(&m, 0, 0, punctuals->count);
    free(leaves);
    return m.err;
}

enum bd_err bd_punctual_tree_create(struct bd_light_uniform *punctuals, uint32_t count,
                                    enum bd_err (*pause)(void *user), void *user,
                                    struct bd_punctual_tree **out, struct bd_err_detail *detail)
{
    BD_ASSERT(count > 0);
    *out = calloc(1, sizeof **out);
    BD_ASSERT(*out);
    (*out)->punctuals = punctuals;
    (*out)->count = count;
    const enum bd_err err = make(*out, pause, user, detail);
    if (err) bd_punctual_tree_destroy(out);
    return err;
}

void bd_punctual_tree_destroy(struct bd_punctual_tree **punctuals)
{
    struct bd_punctual_tree *own = *punctuals;
    *punctuals = NULL;
    if (!own) return;
    bd_emitter_tree_finish(&own->tree);
    free(own->bounds);
    free(own->punctuals);
    free(own);
}

uint64_t bd_punctual_tree_bytes(const struct bd_punctual_tree *punctuals)
{
    const struct bd_emitter_tree *tree = &punctuals->tree;
    return sizeof *punctuals +
           (uint64_t)punctuals->count *
               (sizeof *punctuals->punctuals + 2 * sizeof *punctuals->bounds +
                2 * sizeof *tree->nodes + sizeof *tree->order + sizeof *tree->place);
}

// --- what reaches whom --------------------------------------------------------------------------

// A box of receivers, or a point.
struct box {
    f3 middle, half;
    float radius;
};

static struct box box_of(f3 least, f3 most)
{
    const f3 half = f3_scale(f3_sub(most, least), 0.5f);
    return (struct box){f3_add(least, half), half, f3_length(half)};
}

// Whether all lines from the one ball to the other, `to` between their middles, lie off the cone.
static bool looks_elsewhere(const struct bd_punctual_bound *bound, f3 to, float distance,
                            float radius)
{
    if (bound->cosine <= ANY_COSINE || distance <= radius) return false;
    const float sine = radius / distance, cosine = f_sqrt(1 - sine * sine);
    const float sine_of_both = bound->sine * cosine + bound->cosine * sine;
    if (sine_of_both <= 0) return false; // half of all directions and more
    const float least = bound->cosine * cosine - bound->sine * sine;
    return f3_dot(bound->axis, to) < (least - SLACK) * distance;
}

struct way {
    f3 to;                    // from the punctual lights' middle to the box's
    float distance2, radius2; // of the middles; of the punctual lights' box
    float nearest2;           // between the boxes
};

// False where nothing of it comes.
static bool find_way(const struct bd_punctual_tree *punctuals, uint32_t node, const struct box *box,
                     struct way *way)
{
    const struct bd_punctual_bound *bound = &punctuals->bounds[node];
    const f3 to = f3_sub(box->middle, bound->middle);
    const f3 off = f3_max(f3_sub(f3_abs(to), f3_add(bound->half, box->half)), 0);
    *way = (struct way){to, f3_dot(to, to), bound->radius * bound->radius, f3_dot(off, off)};
    if (way->nearest2 > bound->reach * bound->reach * (1 + SLACK)) return false;
    return !looks_elsewhere(bound, to, f_sqrt(way->distance2), bound->radius + box->radius);
}

// The most that a point of the box gets, held to where the distance tells nothing.
static float most_in(const struct bd_punctual_tree *punctuals, uint32_t node, const struct box *box)
{
    struct way way;
    const float even = punctuals->bounds[node].even, flux = punctuals->tree.nodes[node].flux;
    if (!(flux > 0) || !find_way(punctuals, node, box, &way)) return even;
    const float least2 = 1e-3f * (way.radius2 + box->radius * box->radius);
    return even + flux / f_max(f_max(way.nearest2, least2), 1e-30f);
}

float bd_punctual_tree_weight(const struct bd_punctual_tree *punctuals, uint32_t node, f3 point,
                              f3 normal)
{
    struct way way;
    const struct bd_emitter_node *n = &punctuals->tree.nodes[node];
    const struct box at = {.middle = point};
    const float even = punctuals->bounds[node].even;
    if (!(n->flux > 0) || !find_way(punctuals, node, &at, &way)) return even;
    const float height =
        f3_dot(f3_abs(normal), punctuals->bounds[node].half) - f3_dot(normal, way.to);
    if (!(height > 0)) return even;
    const float far2 = f_max(f_max(way.distance2, way.radius2), 1e-30f);
    const float cosine = f_min(height / f_sqrt(far2), 1);
    return even + n->flux * f_max(cosine, 1e-3f) / far2;
}

// --- cuts ---------------------------------------------------------------------------------------

static void add(const struct bd_punctual_tree *punctuals, const struct box *box,
                struct bd_punctual_node node, struct bd_punctual_cut *cut)
{
    node.most = most_in(punctuals, node.node, box);
    if (!(node.most > 0)) return;
    cut->below += node.end - node.begin;
    struct bd_punctual_node *to = &cut->nodes[cut->count++];
    if (node.end - node.begin == 1) {
        *to = cut->nodes[cut->punctual_count];
        to = &cut->nodes[cut->punctual_count++];
    }
    *to = node;
}

// Who may light the box most, of those that are several; any where there is room for all; `count`
// where there is none.
static uint32_t next_to_split(const struct bd_punctual_cut *cut)
{
    if (cut->below <= BD_PUNCTUAL_CUT_MAX) return cut->punctual_count;
    uint32_t next = cut->count;
    float most = 0;
    for (uint32_t i = cut->punctual_count; i < cut->count; i++) {
        if (!(cut->nodes[i].most > most)) continue;
        most = cut->nodes[i].most;
        next = i;
    }
    return next;
}

static void split(const struct bd_punctual_node *node, struct bd_punctual_node half[2])
{
    const uint32_t middle = node->begin + (node->end - node->begin) / 2;
    half[0] =
        (struct bd_punctual_node){.node = node->node + 1, .begin = node->begin, .end = middle};
    half[1] = (struct bd_punctual_node){
        .node = node->node + 2 * (middle - node->begin), .begin = middle, .end = node->end};
}

void bd_punctual_tree_cut(const struct bd_punctual_tree *punctuals, f3 least, f3 most,
                          struct bd_punctual_cut *cut)
{
    const struct box box = box_of(least, most);
    cut->count = cut->punctual_count = cut->below = 0;
    add(punctuals, &box, (struct bd_punctual_node){.end = punctuals->count}, cut);
    while (cut->count < BD_PUNCTUAL_CUT_MAX) {
        const uint32_t at = next_to_split(cut);
        if (at == cut->count) return;
        struct bd_punctual_node half[2];
        split(&cut->nodes[at], half);
        cut->below -= cut->nodes[at].end - cut->nodes[at].begin;
        cut->nodes[at] = cut->nodes[--cut->count];
        for (int i = 0; i < 2; i++) add(punctuals, &box, half[i], cut);
    }
}

// --- drawing ------------------------------------------------------------------------------------

bool bd_punctual_tree_draw(const struct bd_punctual_tree *punctuals,
                           const struct bd_punctual_node *below, f3 point, f3 normal, float number,
                           uint32_t *punctual, float *pdf)
{
    struct bd_punctual_node at = *below, half[2];
    *pdf = 1;
    while (at.end - at.begin > 1) {
        split(&at, half);
        const float first = bd_punctual_tree_weight(punctuals, half[0].node, point, normal);
        const float both = first + bd_punctual_tree_weight(punctuals, half[1].node, point, normal);
        if (!(both > 0)) return false;
        const float share = first / both;
        const bool is_first = number < share;
        const float own = is_first ? share : 1 - share;
        number = f_min(f_max((is_first ? number : number - share) / own, 0), 0x1.fffffep-1f);
        *pdf *= own;
        at = half[is_first ? 0 : 1];
    }
    *punctual = punctuals->tree.order[at.begin];
    return *pdf > 0;
}
