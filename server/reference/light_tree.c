#include "reference/light_tree.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "base/assert.h"
#include "reference/vec3f.h"

#define LEAF      0x80000000u
#define TWO_SIDED 0x40000000u
#define INDEX     0x3fffffffu

#define BINS 12
// From this depth on halves are of equal count: a way has at most 64 bits, a tree 2^30 lights.
#define DEPTH_OF_COUNTS 32

// Of all power, so that none is lost in a float.
#define POWER_MIN 1e-30

// --- what a node can give -----------------------------------------------------------------------

// Least share of a cosine that is not zero for sure.
#define COSINE_MIN 0.02
// Least distance to a box as a share of the largest.
#define NEAREST_SHARE 0.0625
// Rounding of coordinates, as a share of distances about 1.
#define ROUNDING 0x1p-20

// Without the library's calls, as in vec3f.h. Double: punctual lights may be as far away as two
// numbers of a file allow.
static inline double least_of(double a, double b)
{
    return a < b ? a : b;
}

static inline double most_of(double a, double b)
{
    return a > b ? a : b;
}

// A box as seen from a point.
struct sight {
    double near_squared, far_squared; // distances
    double squared, distance;         // what counts as the distance
};

static struct sight look(const struct bd_light_node *node, const float p[3])
{
    double near = 0, far = 0;
    for (int k = 0; k < 3; k++) {
        double below = (double)node->low[k] - p[k], above = (double)p[k] - node->high[k];
        double out = most_of(most_of(below, above), 0), in = most_of(-below, -above);
        near += out * out;
        far += in * in;
    }
    double largest = most_of(far, 1e-18);
    double least = most_of(near, NEAREST_SHARE * NEAREST_SHARE * largest);
    double squared = sqrt(least * largest);
    return (struct sight){near, far, squared, sqrt(squared)};
}

// The most that a point of the box lies from `p` along `axis`, times `sign`.
static double farthest_along(const struct bd_light_node *node, const float p[3],
                             const float axis[3], double sign)
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        double along = sign * axis[k];
        sum += along * ((along > 0 ? node->high[k] : node->low[k]) - (double)p[k]);
    }
    return sum;
}

// Cosine of an angle less `spread`, 1 if nothing is left of it.
static double cosine_less(double cosine, double cos_spread)
{
    if (cosine >= cos_spread) return 1;
    double sines = (1 - cosine * cosine) * (1 - cos_spread * cos_spread);
    return cosine * cos_spread + (sines > 0 ? sqrt(sines) : 0);
}

// The largest that a length along an axis can be as a cosine.
static double greatest_cosine(const struct sight *sight, double along)
{
    double by = along > 0 ? sight->near_squared : sight->far_squared;
    if (along * along >= by) return along > 0 ? 1 : -1;
    return copysign(sqrt(along * along / by), along);
}

// Whether it is certain that all lights face away by more than they shine.
static bool is_averted(const struct bd_light_node *node, const struct sight *sight, double ahead,
                       double cosine)
{
    if (ahead > 0 && cosine <= 0) return false;
    double slack = ROUNDING * (1 + 1 / sight->distance);
    return cosine_less(greatest_cosine(sight, ahead), node->cos_spread) < cosine - slack;
}

// The share of a node's power that goes towards the receiver. 0: none for sure.
static double sent_share(const struct bd_light_node *node, const struct bd_light_reach *reach,
                         const struct sight *sight, const float p[3])
{
    if (reach && sight->near_squared > (double)reach->range * reach->range * (1 + ROUNDING))
        return 0;
    if (node->cos_spread <= -1) return 1;
    double ahead = farthest_along(node, p, node->axis, -1);
    if (node->next & TWO_SIDED) ahead = most_of(ahead, farthest_along(node, p, node->axis, 1));
    if (is_averted(node, sight, ahead, reach ? reach->cosine : 0)) return 0;
    if (reach) return 1;
    double cosine = most_of(least_of(ahead / sight->distance, 1), -1);
    return most_of(cosine_less(cosine, node->cos_spread), COSINE_MIN);
}

static double received_share(const struct bd_light_node *node, const struct sight *sight,
                             const struct bd_receiver *receiver)
{
    if (receiver->all_round) return 1;
    const float *p = receiver->position;
    double above = farthest_along(node, p, receiver->normal_geometric, 1);
    if (above < -ROUNDING * (1 + sight->distance)) return 0;
    double cosine = farthest_along(node, p, receiver->normal, 1) / sight->distance;
    return least_of(most_of(cosine, COSINE_MIN), 1);
}

// 0 only if nothing can come from there.
static double importance(const struct bd_light_tree *tree, uint32_t index,
                         const struct bd_receiver *receiver)
{
    const struct bd_light_node *node = &tree->nodes[index];
    const struct sight sight = look(node, receiver->position);
    const struct bd_light_reach *reach = tree->reach ? &tree->reach[index] : NULL;
    double received = received_share(node, &sight, receiver);
    if (received == 0) return 0;
    double sent = sent_share(node, reach, &sight, receiver->position);
    return node->power * sent * received / sight.squared;
}

// Of the first of two children. Where neither gives anything, light is drawn by power: in vain.
static double first_share(const struct bd_light_tree *tree, uint32_t first,
                          const struct bd_receiver *receiver)
{
    const struct bd_light_node *nodes = &tree->nodes[first];
    double a = 0, b = 0;
    if (receiver) {
        a = importance(tree, first, receiver);
        b = importance(tree, first + 1, receiver);
        if (a > 0 && b > 0) {
            double share = a / (a + b);
            return least_of(most_of(share, BD_LIGHT_SHARE_MIN), 1 - BD_LIGHT_SHARE_MIN);
        }
        if (a > 0) return 1;
        if (b > 0) return 0;
    }
    return nodes[0].power / ((double)nodes[0].power + nodes[1].power);
}

// --- choosing -----------------------------------------------------------------------------------

// No number of 53 bits draws less; a quotient by it is finite.
#define PROBABILITY_MIN 1e-36

// Those below a node: the numbers that are less than the first child's share are its own.
static void draw_below(const struct bd_light_tree *tree, const struct bd_receiver *receiver,
                       const struct bd_light_node *node, double product, uint32_t count,
                       struct bd_light_draw *draws)
{
    while (!(node->next & LEAF)) {
        const struct bd_light_node *first = &tree->nodes[node->next & INDEX];
        double share = first_share(tree, node->next & INDEX, receiver);
        uint32_t own = 0;
        for (; own < count && draws[own].u < share; own++)
            draws[own].u = least_of(draws[own].u / share, 1 - 0x1p-53);
        for (uint32_t i = own; i < count; i++)
            draws[i].u = least_of((draws[i].u - share) / (1 - share), 1 - 0x1p-53);
        if (own > 0 && own < count) draw_below(tree, receiver, first, product * share, own, draws);
        bool is_second = own < count;
        if (is_second) draws += own, count -= own;
        product *= is_second ? 1 - share : share;
        node = first + is_second;
    }
    for (uint32_t i = 0; i < count; i++) {
        draws[i].light = node->next & INDEX;
        draws[i].probability = (float)most_of(product, PROBABILITY_MIN);
    }
}

void bd_light_tree_choose(const struct bd_light_tree *tree, const struct bd_receiver *receiver,
                          uint32_t count, struct bd_light_draw *draws)
{
    draw_below(tree, receiver, tree->nodes, 1, count, draws);
}

float bd_light_tree_probability(const struct bd_light_tree *tree,
                                const struct bd_receiver *receiver, uint32_t light)
{
    const struct bd_light_node *node = tree->nodes;
    double product = 1;
    for (uint64_t way = tree->ways[light]; !(node->next & LEAF); way >>= 1) {
        uint32_t child = node->next & INDEX;
        double share = first_share(tree, child, receiver);
        product *= way & 1 ? 1 - share : share;
        node = &tree->nodes[child + (way & 1)];
    }
    bool is_it = (node->next & INDEX) == light;
    return is_it && product > 0 ? (float)fmax(product, PROBABILITY_MIN) : 0;
}

// --- building -----------------------------------------------------------------------------------

struct building {
    struct bd_light_tree *tree;
    struct bd_tree_light *lights; // those with power
    uint32_t *numbers;            // of the caller
    uint32_t *order;              // indices of `lights`: those of a node are neighbours
    double power;                 // of all
};

struct box {
    float low[3], high[3];
};

static void widen(struct box *box, const struct bd_tree_light *light)
{
    for (int k = 0; k < 3; k++) {
        box->low[k] = bd_minf(light->low[k], box->low[k]);
        box->high[k] = bd_maxf(light->high[k], box->high[k]);
    }
}

static const struct box no_box = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};

// What is summed up of the lights of a node, or of a bin.
struct sum {
    struct box box;
    double power, facing[3]; // directions by power
    uint32_t count;
};

static void add_light(struct sum *sum, const struct bd_tree_light *light)
{
    widen(&sum->box, light);
    sum->power += light->power;
    for (int k = 0; k < 3; k++) sum->facing[k] += light->power * light->axis[k];
    sum->count++;
}

static void add_sum(struct sum *sum, const struct sum *other)
{
    for (int k = 0; k < 3; k++) {
        sum->box.low[k] = bd_minf(other->box.low[k], sum->box.low[k]);
        sum->box.high[k] = bd_maxf(other->box.high[k], sum->box.high[k]);
        sum->facing[k] += other->facing[k];
    }
    sum->power += other->power;
    sum->count += other->count;
}

static double length(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

// What a walk pays for lights that it cannot tell apart: power x size^2 x the spread of where they
// face, from 1 to 4, which their mean direction's length stands for.
static double cost_of(const struct sum *sum)
{
    if (sum->count == 0) return 0;
    double span[3];
    for (int k = 0; k < 3; k++) span[k] = (double)sum->box.high[k] - sum->box.low[k];
    double unity = sum->power > 0 ? length(sum->facing) / sum->power : 0;
    double size = length(span);
    return sum->power * size * size * (4 - 3 * fmin(unity, 1));
}

static struct sum sum_of(const struct building *b, uint32_t first, uint32_t count)
{
    struct sum sum = {.box = no_box};
    for (uint32_t i = first; i < first + count; i++) add_light(&sum, &b->lights[b->order[i]]);
    return sum;
}

static bool is_everywhere(const struct bd_tree_light *light)
{
    return light->axis[0] == 0 && light->axis[1] == 0 && light->axis[2] == 0;
}

static void set_cone(const struct building *b, uint32_t first, uint32_t count,
                     const struct sum *sum, struct bd_light_node *node)
{
    double size = length(sum->facing);
    node->cos_spread = size > 0 ? 1 : -1;
    for (int k = 0; k < 3; k++) node->axis[k] = size > 0 ? (float)(sum->facing[k] / size) : 0;
    for (uint32_t i = first; i < first + count; i++) {
        const struct bd_tree_light *light = &b->lights[b->order[i]];
        if (is_everywhere(light)) node->cos_spread = -1;
        float cosine = bd_vec3f_dot(light->axis, node->axis);
        node->cos_spread = bd_minf(cosine, node->cos_spread);
        if (light->two_sided) node->next |= TWO_SIDED;
    }
    // A cosine's own rounding near 1 is an angle of its root.
    if (count > 1 && node->cos_spread < 1) node->cos_spread -= 0x1p-22f;
}

static void set_reach(const struct building *b, uint32_t first, uint32_t count,
                      struct bd_light_reach *reach)
{
    *reach = (struct bd_light_reach){.cosine = 1, .range = 0};
    for (uint32_t i = first; i < first + count; i++) {
        const struct bd_light_reach *own = &b->lights[b->order[i]].reach;
        reach->cosine = bd_minf(own->cosine, reach->cosine);
        reach->range = bd_maxf(own->range, reach->range);
    }
}

// --- where a node is split ----------------------------------------------------------------------

struct split {
    int axis;
    double middle; // twice the coordinate
    double cost;
};

static double middle_of(const struct bd_tree_light *light, int axis)
{
    return (double)light->low[axis] + light->high[axis];
}

static uint32_t bin_of(double middle, double low, double high)
{
    double place = (middle - low) / (high - low) * BINS;
    return place >= BINS ? BINS - 1 : place > 0 ? (uint32_t)place : 0;
}

static void try_planes(const struct sum bins[BINS], int axis, double low, double high,
                       struct split *best)
{
    double above[BINS];
    struct sum sum = {.box = no_box};
    for (int i = BINS - 1; i > 0; i--) {
        add_sum(&sum, &bins[i]);
        above[i] = sum.count ? cost_of(&sum) : INFINITY;
    }
    sum = (struct sum){.box = no_box};
    for (int i = 1; i < BINS; i++) {
        add_sum(&sum, &bins[i - 1]);
        double cost = sum.count ? cost_of(&sum) + above[i] : INFINITY;
        if (cost < best->cost) *best = (struct split){axis, low + (high - low) * i / BINS, cost};
    }
}

static struct split best_split(const struct building *b, uint32_t first, uint32_t count)
{
    struct split best = {.axis = -1, .cost = INFINITY};
    for (int axis = 0; axis < 3; axis++) {
        double low = INFINITY, high = -INFINITY;
        for (uint32_t i = first; i < first + count; i++) {
            double middle = middle_of(&b->lights[b->order[i]], axis);
            low = fmin(low, middle);
            high = fmax(high, middle);
        }
        if (!(high > low)) continue;
        struct sum bins[BINS];
        for (int i = 0; i < BINS; i++) bins[i] = (struct sum){.box = no_box};
        for (uint32_t i = first; i < first + count; i++) {
            const struct bd_tree_light *light = &b->lights[b->order[i]];
            add_light(&bins[bin_of(middle_of(light, axis), low, high)], light);
        }
        try_planes(bins, axis, low, high, &best);
    }
    return best;
}

// Lights below the plane first; returns how many they are.
static uint32_t part(const struct building *b, uint32_t first, uint32_t count,
                     const struct split *split)
{
    uint32_t low = first, high = first + count;
    while (low < high) {
        uint32_t light = b->order[low];
        if (middle_of(&b->lights[light], split->axis) < split->middle) {
            low++;
        } else {
            b->order[low] = b->order[--high];
            b->order[high] = light;
        }
    }
    return low - first;
}

static void make_node(const struct building *b, uint32_t index, uint32_t first, uint32_t count,
                      uint32_t depth, uint64_t way)
{
    struct bd_light_tree *tree = b->tree;
    struct bd_light_node *node = &tree->nodes[index];
    const struct sum sum = sum_of(b, first, count);
    *node = (struct bd_light_node){.power = (float)fmax(sum.power / b->power, POWER_MIN)};
    bd_vec3f_copy(node->low, sum.box.low);
    bd_vec3f_copy(node->high, sum.box.high);
    set_cone(b, first, count, &sum, node);
    if (tree->reach) set_reach(b, first, count, &tree->reach[index]);
    if (count == 1) {
        uint32_t number = b->numbers[b->order[first]];
        node->next |= LEAF | number;
        tree->ways[number] = way;
        return;
    }
    const struct split split =
        depth < DEPTH_OF_COUNTS ? best_split(b, first, count) : (struct split){.axis = -1};
    uint32_t below = split.axis >= 0 ? part(b, first, count, &split) : 0;
    if (below == 0 || below == count) below = count / 2;
    uint32_t child = tree->node_count;
    tree->node_count += 2;
    node->next |= child;
    make_node(b, child, first, below, depth + 1, way);
    make_node(b, child + 1, first + below, count - below, depth + 1, way | 1ull << depth);
}

// A two-sided light faces both ways: the same way as its like, so that they have a common axis.
static void align(struct bd_tree_light *light)
{
    const float *a = light->axis;
    int k = fabsf(a[0]) >= fabsf(a[1]) ? 0 : 1;
    if (fabsf(a[2]) > fabsf(a[k])) k = 2;
    if (light->two_sided && a[k] < 0) bd_vec3f_scale(light->axis, a, -1);
}

// Beyond what rays can be asked about, and no number at all.
static float held(float x)
{
    const float reach = 1e30f;
    return bd_minf(bd_maxf(x, -reach), reach);
}

static void list(struct building *b, uint32_t count, bd_tree_light_at at, const void *user)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < count; i++) {
        struct bd_tree_light light = at(user, i);
        if (!(light.power > 0) || !isfinite(light.power)) continue;
        for (int k = 0; k < 3; k++) {
            light.low[k] = held(light.low[k]);
            light.high[k] = held(light.high[k]);
        }
        align(&light);
        b->lights[kept] = light;
        b->numbers[kept] = i;
        b->order[kept] = kept;
        b->power += light.power;
        kept++;
    }
    b->tree->count = kept;
}

static bool allocate(struct building *b, uint32_t count, bool is_punctuals)
{
    struct bd_light_tree *tree = b->tree;
    b->lights = malloc(count * sizeof *b->lights);
    b->numbers = malloc(count * sizeof *b->numbers);
    b->order = malloc(count * sizeof *b->order);
    tree->nodes = malloc(2 * (size_t)count * sizeof *tree->nodes);
    tree->ways = calloc(count, sizeof *tree->ways);
    if (is_punctuals) tree->reach = malloc(2 * (size_t)count * sizeof *tree->reach);
    return b->lights && b->numbers && b->order && tree->nodes && tree->ways &&
           (!is_punctuals || tree->reach);
}

enum bd_err bd_light_tree_init(struct bd_light_tree *tree, uint32_t count, bool is_punctuals,
                               bd_tree_light_at at, const void *user, struct bd_err_detail *detail)
{
    *tree = (struct bd_light_tree){0};
    if (count == 0) return BD_ERR_OK;
    BD_ASSERT_CMP(count, <=, 1u << 30);
    struct building b = {.tree = tree};
    enum bd_err err = BD_ERR_OK;
    if (!allocate(&b, count, is_punctuals))
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "reference", "no memory for a tree of %u lights",
                         count);
    if (!err) list(&b, count, at, user);
    if (!err && tree->count > 0) {
        tree->node_count = 1;
        make_node(&b, 0, 0, tree->count, 0, 0);
    }
    free(b.lights);
    free(b.numbers);
    free(b.order);
    return err;
}

void bd_light_tree_finish(struct bd_light_tree *tree)
{
    free(tree->nodes);
    free(tree->reach);
    free(tree->ways);
    *tree = (struct bd_light_tree){0};
}

uint64_t bd_light_tree_bytes(const struct bd_light_tree *tree, uint32_t light_count)
{
    uint64_t reach_bytes = tree->reach ? sizeof *tree->reach : 0;
    return 2 * (uint64_t)light_count * (sizeof *tree->nodes + reach_bytes) +
           light_count * sizeof *tree->ways;
}
