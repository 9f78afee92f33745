#include "lights/emitter_tree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PAUSE_EVERY 4096u
#define DIGIT_BITS  8u
#define DIGITS      256u

struct building {
    struct bd_emitter_tree *tree;
    const struct bd_emitter_leaf *leaves;
    uint32_t *keys, *spare;
    enum bd_err (*pause)(void *user);
    void *user;
    uint32_t done;
    enum bd_err err;
};

static void rest(struct building *b)
{
    if (!b->err && ++b->done % PAUSE_EVERY == 0) b->err = b->pause(b->user);
}

// --- boxes --------------------------------------------------------------------------------------

#define PI 3.14159265358979
// Cones are wider by what rounding may take away.
#define CONE_MARGIN 1e-4
// From here on two axes say little of what lies between them.
#define OPPOSITE 3.0

static double angle_between(f3 a, f3 b)
{
    const double across[] = {(double)a.y * b.z - (double)a.z * b.y,
                             (double)a.z * b.x - (double)a.x * b.z,
                             (double)a.x * b.y - (double)a.y * b.x};
    const double cosine = (double)a.x * b.x + (double)a.y * b.y + (double)a.z * b.z;
    return atan2(hypot(across[0], hypot(across[1], across[2])), cosine);
}

// `turn` of the way `between` two unit vectors that are not opposite.
static f3 turned(f3 a, f3 b, double turn, double between)
{
    const double sine = sin(between), share = between > 0 ? turn / between : 0;
    const bool is_bent = sine > 1e-6;
    const double of_a = is_bent ? sin(between - turn) / sine : 1 - share;
    const double of_b = is_bent ? sin(turn) / sine : share;
    return f3_unit(f3_add(f3_scale(a, (float)of_a), f3_scale(b, (float)of_b)));
}

// The narrowest cone about both, or about all directions.
static void join_cones(const struct bd_emitter_node *a, const struct bd_emitter_node *b,
                       struct bd_emitter_node *out)
{
    const double between = angle_between(a->axis, b->axis);
    const double of_a = atan2((double)a->spread_sin, (double)a->spread_cos);
    const double of_b = atan2((double)b->spread_sin, (double)b->spread_cos);
    const bool holds_b = between + of_b <= of_a, holds_a = between + of_a <= of_b;
    const double half = holds_b ? of_a : holds_a ? of_b : (of_a + between + of_b) / 2;
    const bool is_cone = half + CONE_MARGIN < PI && (between < OPPOSITE || holds_a || holds_b);
    const double turn = holds_b ? 0 : holds_a ? between : half - of_a;
    out->axis = is_cone ? turned(a->axis, b->axis, turn, between) : a->axis;
    out->spread_cos = is_cone ? (float)cos(half + CONE_MARGIN) : -1;
    out->spread_sin = is_cone ? (float)sin(half + CONE_MARGIN) : 0;
}

static struct bd_emitter_node joined(const struct bd_emitter_node *a,
                                     const struct bd_emitter_node *b)
{
    struct bd_emitter_node both = {
        .least = f3_of(fminf(a->least.x, b->least.x), fminf(a->least.y, b->least.y),
                       fminf(a->least.z, b->least.z)),
        .most = f3_of(fmaxf(a->most.x, b->most.x), fmaxf(a->most.y, b->most.y),
                      fmaxf(a->most.z, b->most.z)),
        .flux = a->flux + b->flux,
    };
    both.radius = 0.5f * f3_length(f3_sub(both.most, both.least));
    join_cones(a, b, &both);
    return both;
}

// --- order --------------------------------------------------------------------------------------

static float along(f3 at, int axis)
{
    return axis == 0 ? at.x : axis == 1 ? at.y : at.z;
}

static f3 middle_of(const struct building *b, uint32_t at)
{
    return b->leaves[b->tree->order[at]].middle;
}

// Along which their middles lie farthest apart.
static int longest_axis(struct building *b, uint32_t begin, uint32_t end)
{
    f3 least = middle_of(b, begin), most = least;
    for (uint32_t i = begin + 1; i < end; i++) {
        const f3 at = middle_of(b, i);
        least = f3_of(fminf(least.x, at.x), fminf(least.y, at.y), fminf(least.z, at.z));
        most = f3_of(fmaxf(most.x, at.x), fmaxf(most.y, at.y), fmaxf(most.z, at.z));
        rest(b);
    }
    const f3 size = f3_sub(most, least);
    if (size.x >= size.y && size.x >= size.z) return 0;
    return size.y >= size.z ? 1 : 2;
}

// Numbers that have the order of coordinates.
static uint32_t key_of(float coordinate)
{
    uint32_t bits;
    memcpy(&bits, &coordinate, sizeof bits);
    return bits >> 31 ? ~bits : bits | 0x80000000u;
}

// The key of the `rank`-th of some, digit by digit: so many passes whatever they are.
static uint32_t key_of_rank(struct building *b, const uint32_t *keys, uint32_t count, uint32_t rank)
{
    uint32_t found = 0;
    for (uint32_t shift = 32; shift > 0;) {
        uint32_t of_digit[DIGITS] = {0}, digit = 0;
        const uint32_t above = shift == 32 ? 0 : UINT32_MAX << shift;
        shift -= DIGIT_BITS;
        for (uint32_t i = 0; i < count; i++)
            of_digit[keys[i] >> shift & (DIGITS - 1)] += (keys[i] & above) == found;
        if (!b->err && count > PAUSE_EVERY) b->err = b->pause(b->user);
        while (rank >= of_digit[digit]) rank -= of_digit[digit++];
        found |= digit << shift;
    }
    return found;
}

// Those below a coordinate first, in the order that they have; of those at it, as many as fit.
static void part_at(struct building *b, uint32_t begin, uint32_t middle, uint32_t end, uint32_t key)
{
    uint32_t below = 0, first = begin, second = middle;
    uint32_t *order = b->tree->order;
    for (uint32_t i = begin; i < end; i++) below += b->keys[i] < key;
    uint32_t equal = middle - begin - below;
    for (uint32_t i = begin; i < end; i++) {
        const bool fits = b->keys[i] == key && equal > 0;
        equal -= fits;
        b->spare[b->keys[i] < key || fits ? first++ : second++] = order[i];
        rest(b);
    }
    memcpy(order + begin, b->spare + begin, (end - begin) * sizeof *order);
}

// Each half as many, by where they lie along the longest axis.
static void halve(struct building *b, uint32_t begin, uint32_t middle, uint32_t end)
{
    const int axis = longest_axis(b, begin, end);
    for (uint32_t i = begin; i < end; i++) {
        b->keys[i] = key_of(along(middle_of(b, i), axis));
        rest(b);
    }
    const uint32_t key = key_of_rank(b, b->keys + begin, end - begin, middle - begin);
    part_at(b, begin, middle, end, key);
}

// --- nodes --------------------------------------------------------------------------------------

static void build(struct building *b, uint32_t node, uint32_t begin, uint32_t end)
{
    struct bd_emitter_node *nodes = b->tree->nodes;
    if (b->err) return;
    if (end - begin == 1) {
        nodes[node] = b->leaves[b->tree->order[begin]].node;
        b->tree->place[b->tree->order[begin]] = begin;
        return;
    }
    const uint32_t middle = begin + (end - begin) / 2, second = node + 2 * (middle - begin);
    halve(b, begin, middle, end);
    build(b, node + 1, begin, middle);
    build(b, second, middle, end);
    if (!b->err) nodes[node] = joined(&nodes[node + 1], &nodes[second]);
}

enum bd_err bd_emitter_tree_init(struct bd_emitter_tree *tree, const struct bd_emitter_leaf *leaves,
                                 uint32_t count, enum bd_err (*pause)(void *user), void *user,
                                 struct bd_err_detail *detail)
{
    struct building b = {.tree = tree, .leaves = leaves, .pause = pause, .user = user};
    tree->count = count;
    tree->nodes = malloc((2 * (size_t)count - 1) * sizeof *tree->nodes);
    tree->order = malloc(count * sizeof *tree->order);
    tree->place = malloc(count * sizeof *tree->place);
    b.keys = malloc(count * sizeof *b.keys);
    b.spare = malloc(count * sizeof *b.spare);
    if (!tree->nodes || !tree->order || !tree->place || !b.keys || !b.spare)
        b.err = bd_err_set(detail, BD_ERR_NO_MEMORY, "scene", "no memory for a tree of %u emitters",
                           count);
    for (uint32_t i = 0; !b.err && i < count; i++) tree->order[i] = i;
    if (!b.err) build(&b, 0, 0, count);
    free(b.keys);
    free(b.spare);
    return b.err;
}

void bd_emitter_tree_finish(struct bd_emitter_tree *tree)
{
    free(tree->nodes);
    free(tree->order);
    free(tree->place);
}

// --- importance ---------------------------------------------------------------------------------

struct look {
    f3 half, to; // of its box; to the middle of that
    float radius2, distance2;
    // 0 only where all of the box lies below the horizon, or all that is in it turns away.
    float light;
};

// The cosine by which those of a node at least turn from a point, at `to` from the middle of their
// box's ball: the angle between their axis and the way back, less the cone's and the ball's.
static inline float facing_of(const struct bd_emitter_node *node, f3 to, float per_distance,
                              float sin2_ball)
{
    const float sin_ball = node->radius * per_distance, cos_ball = f_sqrt(f_max(1 - sin2_ball, 0));
    const float cos_axis = -f3_dot(node->axis, to) * per_distance;
    const float sin_axis = f_sqrt(f_max(1 - cos_axis * cos_axis, 0));
    const float cos_most = node->spread_cos * cos_ball - node->spread_sin * sin_ball;
    const float sin_most = node->spread_sin * cos_ball + node->spread_cos * sin_ball;
    const bool may_face = sin2_ball >= 1 || sin_most <= 0 || cos_axis >= cos_most;
    return may_face ? 1 : cos_axis * cos_most + sin_axis * sin_most;
}

// Below, rounding says too little of how far an emitter turns away and how low it lies.
#define COSINES_LEAST 0.05f

static inline struct look look_at(const struct bd_emitter_node *node, f3 point, f3 normal)
{
    const f3 half = f3_scale(f3_sub(node->most, node->least), 0.5f);
    const f3 to = f3_sub(f3_add(node->least, half), point);
    const float radius2 = node->radius * node->radius;
    const float distance2 = f_max(f3_dot(to, to), 1e-30f), per_distance = 1 / f_sqrt(distance2);
    const float height = f3_dot(normal, to) + f3_dot(f3_abs(normal), half);
    const float facing = facing_of(node, to, per_distance, radius2 / distance2);
    const float cosines = f_min(height * per_distance, 1) * facing;
    const bool may_light = height > 0 && facing > -1e-3f;
    return (struct look){half, to, radius2, distance2,
                         may_light ? node->flux * f_max(cosines, COSINES_LEAST) : 0};
}

// By the distance of its box's middle, held to where it tells nothing.
static inline float weight_of_look(const struct look *look)
{
    return look->light / f_max(look->distance2, look->radius2);
}

// By that of its nearest point.
static inline float nearest_of_look(const struct look *look)
{
    const f3 off = f3_max(f3_sub(f3_abs(look->to), look->half), 0);
    return look->light / f_max(f_max(f3_dot(off, off), 1e-3f * look->radius2), 1e-30f);
}

// --- cuts ---------------------------------------------------------------------------------------

static void set(const struct bd_emitter_tree *tree, struct bd_emitter_cut *cut, uint32_t at,
                uint32_t node, uint32_t begin, uint32_t end, f3 point, f3 normal)
{
    const struct look look = look_at(&tree->nodes[node], point, normal);
    cut->nodes[at].node = node;
    cut->nodes[at].begin = begin;
    cut->nodes[at].end = end;
    cut->nodes[at].weight = weight_of_look(&look);
    cut->nodes[at].nearest = end - begin > 1 ? nearest_of_look(&look) : 0;
}

static uint32_t next_to_split(const struct bd_emitter_cut *cut)
{
    uint32_t next = 0;
    for (uint32_t i = 1; i < cut->count; i++)
        if (cut->nodes[i].nearest > cut->nodes[next].nearest) next = i;
    return next;
}

void bd_emitter_tree_cut(const struct bd_emitter_tree *tree, f3 point, f3 normal,
                         struct bd_emitter_cut *cut)
{
    set(tree, cut, 0, 0, 0, tree->count, point, normal);
    cut->count = 1;
    while (cut->count < BD_EMITTER_CUT_MAX) {
        const uint32_t at = next_to_split(cut);
        const uint32_t node = cut->nodes[at].node, begin = cut->nodes[at].begin;
        const uint32_t end = cut->nodes[at].end, middle = begin + (end - begin) / 2;
        if (!(cut->nodes[at].nearest > 0)) break;
        set(tree, cut, at, node + 1, begin, middle, point, normal);
        set(tree, cut, cut->count++, node + 2 * (middle - begin), middle, end, point, normal);
    }
    cut->weight = 0;
    for (uint32_t i = 0; i < cut->count; i++) cut->weight += cut->nodes[i].weight;
}

// --- drawing ------------------------------------------------------------------------------------

// The pdf of the first half of a node; below 0 where neither has any.
static inline float first_pdf(const struct bd_emitter_tree *tree, uint32_t first, uint32_t second,
                              f3 point, f3 normal)
{
    const struct look a = look_at(&tree->nodes[first], point, normal);
    const struct look b = look_at(&tree->nodes[second], point, normal);
    const float of_a = weight_of_look(&a), both = of_a + weight_of_look(&b);
    return both > 0 ? of_a / both : -1;
}

static float within_1(float number)
{
    return f_min(f_max(number, 0), 0x1.fffffep-1f);
}

bool bd_emitter_tree_draw(const struct bd_emitter_tree *tree, const struct bd_emitter_cut *cut,
                          f3 point, f3 normal, float number, uint32_t *light, float *pdf)
{
    float left = number * cut->weight;
    uint32_t at = 0;
    if (!(cut->weight > 0)) return false;
    while (at + 1 < cut->count && left >= cut->nodes[at].weight) left -= cut->nodes[at++].weight;
    if (!(cut->nodes[at].weight > 0)) return false;
    number = within_1(left / cut->nodes[at].weight);
    *pdf = cut->nodes[at].weight / cut->weight;
    uint32_t node = cut->nodes[at].node, begin = cut->nodes[at].begin, end = cut->nodes[at].end;
    while (end - begin > 1) {
        const uint32_t middle = begin + (end - begin) / 2, second = node + 2 * (middle - begin);
        const float first = first_pdf(tree, node + 1, second, point, normal);
        if (first < 0) return false;
        const bool is_first = number < first;
        const float share = is_first ? first : 1 - first;
        number = within_1((is_first ? number : number - first) / share);
        *pdf *= share;
        node = is_first ? node + 1 : second;
        if (is_first)
            end = middle;
        else
            begin = middle;
    }
    *light = tree->order[begin];
    return *pdf > 0;
}

float bd_emitter_tree_pdf(const struct bd_emitter_tree *tree, const struct bd_emitter_cut *cut,
                          f3 point, f3 normal, uint32_t light)
{
    const uint32_t place = tree->place[light];
    uint32_t at = 0;
    while (place < cut->nodes[at].begin || place >= cut->nodes[at].end) at++;
    uint32_t node = cut->nodes[at].node, begin = cut->nodes[at].begin, end = cut->nodes[at].end;
    float pdf = cut->weight > 0 ? cut->nodes[at].weight / cut->weight : 0;
    while (end - begin > 1) {
        const uint32_t middle = begin + (end - begin) / 2, second = node + 2 * (middle - begin);
        const float first = first_pdf(tree, node + 1, second, point, normal);
        if (first < 0) return 0;
        const bool is_first = place < middle;
        pdf *= is_first ? first : 1 - first;
        node = is_first ? node + 1 : second;
        if (is_first)
            end = middle;
        else
            begin = middle;
    }
    return pdf;
}
