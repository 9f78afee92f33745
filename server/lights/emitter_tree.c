#include "lights/emitter_tree.h"

#include <math.h>
#include <stdlib.h>

#define PAUSE_EVERY 4096u
#define DIGITS      256u
#define PASSES      4u // of 8 bits each

struct building {
    struct bd_emitter_tree *tree;
    const struct bd_emitter_leaf *leaves;
    uint32_t *codes, *spare;
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

static struct bd_emitter_node joined(const struct bd_emitter_node *a,
                                     const struct bd_emitter_node *b)
{
    return (struct bd_emitter_node){
        .least = f3_of(fminf(a->least.x, b->least.x), fminf(a->least.y, b->least.y),
                       fminf(a->least.z, b->least.z)),
        .most = f3_of(fmaxf(a->most.x, b->most.x), fmaxf(a->most.y, b->most.y),
                      fmaxf(a->most.z, b->most.z)),
        .flux = a->flux + b->flux,
    };
}

static struct bd_emitter_node box_of_all(struct building *b)
{
    struct bd_emitter_node all = b->leaves[0].node;
    for (uint32_t i = 1; i < b->tree->count && !b->err; i++) {
        all = joined(&all, &b->leaves[i].node);
        rest(b);
    }
    return all;
}

// --- order --------------------------------------------------------------------------------------

static uint32_t spread_by_three(uint32_t x)
{
    x = (x | x << 16) & 0x030000ffu;
    x = (x | x << 8) & 0x0300f00fu;
    x = (x | x << 4) & 0x030c30c3u;
    return (x | x << 2) & 0x09249249u;
}

static uint32_t place_in(float value, float least, float size)
{
    return size > 0 ? (uint32_t)fminf(fmaxf((value - least) / size * 1024, 0), 1023) : 0;
}

static void find_codes(struct building *b)
{
    const struct bd_emitter_node all = box_of_all(b);
    const f3 size = f3_sub(all.most, all.least);
    const float largest = fmaxf(size.x, fmaxf(size.y, size.z));
    for (uint32_t i = 0; i < b->tree->count && !b->err; i++) {
        const f3 middle = b->leaves[i].middle;
        b->codes[i] = spread_by_three(place_in(middle.x, all.least.x, largest)) |
                      spread_by_three(place_in(middle.y, all.least.y, largest)) << 1 |
                      spread_by_three(place_in(middle.z, all.least.z, largest)) << 2;
        b->tree->order[i] = i;
        rest(b);
    }
}

// By one digit, stable.
static void sort_by_digit(struct building *b, uint32_t shift)
{
    uint32_t first[DIGITS + 1] = {0}, *order = b->tree->order;
    const uint32_t count = b->tree->count;
    for (uint32_t i = 0; i < count; i++) first[(b->codes[i] >> shift & 255) + 1]++;
    for (uint32_t d = 0; d < DIGITS; d++) first[d + 1] += first[d];
    for (uint32_t i = 0; i < count && !b->err; i++) {
        b->spare[first[b->codes[order[i]] >> shift & 255]++] = order[i];
        rest(b);
    }
    if (b->err) return;
    b->tree->order = b->spare;
    b->spare = order;
}

// --- nodes --------------------------------------------------------------------------------------

static void build(struct building *b, uint32_t node, uint32_t begin, uint32_t end)
{
    struct bd_emitter_node *nodes = b->tree->nodes;
    if (b->err) return;
    if (end - begin == 1) {
        nodes[node] = b->leaves[b->tree->order[begin]].node;
        b->tree->place[b->tree->order[begin]] = begin;
        rest(b);
        return;
    }
    const uint32_t middle = begin + (end - begin) / 2, second = node + 2 * (middle - begin);
    build(b, node + 1, begin, middle);
    build(b, second, middle, end);
    if (!b->err) nodes[node] = joined(&nodes[node + 1], &nodes[second]);
}

enum bd_err bd_emitter_tree_init(struct bd_emitter_tree *tree, const struct bd_emitter_leaf *leaves,
                                 uint32_t count, enum bd_err (*pause)(void *user), void *user,
                                 struct bd_fault *fault)
{
    struct building b = {.tree = tree, .leaves = leaves, .pause = pause, .user = user};
    tree->count = count;
    tree->nodes = malloc((2 * (size_t)count - 1) * sizeof *tree->nodes);
    tree->order = malloc(count * sizeof *tree->order);
    tree->place = malloc(count * sizeof *tree->place);
    b.codes = malloc(count * sizeof *b.codes);
    b.spare = malloc(count * sizeof *b.spare);
    if (!tree->nodes || !tree->order || !tree->place || !b.codes || !b.spare)
        b.err = bd_fault_set(fault, BD_ERR_NO_MEMORY, "scene",
                             "no memory for a tree of %u emitters", count);
    if (!b.err) find_codes(&b);
    for (uint32_t pass = 0; !b.err && pass < PASSES; pass++) sort_by_digit(&b, 8 * pass);
    if (!b.err) build(&b, 0, 0, count);
    free(b.codes);
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
    float light; // 0 only where all of the box lies below the horizon
};

static inline struct look look_at(const struct bd_emitter_node *node, f3 point, f3 normal)
{
    const f3 half = f3_scale(f3_sub(node->most, node->least), 0.5f);
    const f3 to = f3_sub(f3_add(node->least, half), point);
    const float radius2 = f3_dot(half, half), distance2 = f3_dot(to, to);
    const float height = f3_dot(normal, to) + f3_dot(f3_abs(normal), half);
    const float cosine = f_min(height / f_sqrt(f_max(distance2, 1e-30f)), 1);
    const float light = height > 0 ? node->flux * f_max(cosine, 1e-3f) : 0;
    return (struct look){half, to, radius2, distance2, light};
}

// By the distance of its box's middle, held to where it tells nothing.
static inline float weight_of_look(const struct look *look)
{
    return look->light / f_max(f_max(look->distance2, look->radius2), 1e-30f);
}

// By that of its nearest point.
static inline float nearest_of_look(const struct look *look)
{
    const f3 off = f3_max(f3_sub(f3_abs(look->to), look->half), 0);
    return look->light / f_max(f_max(f3_dot(off, off), 1e-3f * look->radius2), 1e-30f);
}

static inline float weight_of(const struct bd_emitter_tree *tree, uint32_t node, f3 point,
                              f3 normal)
{
    const struct look look = look_at(&tree->nodes[node], point, normal);
    return weight_of_look(&look);
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

// The chance of the first half of a node; below 0 where neither has any.
static float first_chance(const struct bd_emitter_tree *tree, uint32_t first, uint32_t second,
                          f3 point, f3 normal)
{
    const float a = weight_of(tree, first, point, normal);
    const float b = weight_of(tree, second, point, normal);
    return a + b > 0 ? a / (a + b) : -1;
}

static float within_1(float number)
{
    return f_min(f_max(number, 0), 0x1.fffffep-1f);
}

bool bd_emitter_tree_draw(const struct bd_emitter_tree *tree, const struct bd_emitter_cut *cut,
                          f3 point, f3 normal, float number, uint32_t *light, float *chance)
{
    float left = number * cut->weight;
    uint32_t at = 0;
    if (!(cut->weight > 0)) return false;
    while (at + 1 < cut->count && left >= cut->nodes[at].weight) left -= cut->nodes[at++].weight;
    if (!(cut->nodes[at].weight > 0)) return false;
    number = within_1(left / cut->nodes[at].weight);
    *chance = cut->nodes[at].weight / cut->weight;
    uint32_t node = cut->nodes[at].node, begin = cut->nodes[at].begin, end = cut->nodes[at].end;
    while (end - begin > 1) {
        const uint32_t middle = begin + (end - begin) / 2, second = node + 2 * (middle - begin);
        const float first = first_chance(tree, node + 1, second, point, normal);
        if (first < 0) return false;
        const bool is_first = number < first;
        const float share = is_first ? first : 1 - first;
        number = within_1((is_first ? number : number - first) / share);
        *chance *= share;
        node = is_first ? node + 1 : second;
        if (is_first)
            end = middle;
        else
            begin = middle;
    }
    *light = tree->order[begin];
    return *chance > 0;
}

float bd_emitter_tree_chance(const struct bd_emitter_tree *tree, const struct bd_emitter_cut *cut,
                             f3 point, f3 normal, uint32_t light)
{
    const uint32_t place = tree->place[light];
    uint32_t at = 0;
    while (place < cut->nodes[at].begin || place >= cut->nodes[at].end) at++;
    uint32_t node = cut->nodes[at].node, begin = cut->nodes[at].begin, end = cut->nodes[at].end;
    float chance = cut->weight > 0 ? cut->nodes[at].weight / cut->weight : 0;
    while (end - begin > 1) {
        const uint32_t middle = begin + (end - begin) / 2, second = node + 2 * (middle - begin);
        const float first = first_chance(tree, node + 1, second, point, normal);
        if (first < 0) return 0;
        const bool is_first = place < middle;
        chance *= is_first ? first : 1 - first;
        node = is_first ? node + 1 : second;
        if (is_first)
            end = middle;
        else
            begin = middle;
    }
    return chance;
}
