#include "lights/disk_sums.h"

#include <stdlib.h>

#include "lights/directions.h"

// So few are looked at one by one.
#define PART_POINTS 16u

static const struct {
    uint32_t a, b;
} PAIRS[6] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

// Of the colours of some points: their sum, and with places about the box's middle once and twice.
struct bd_disk_part {
    f3 middle, half; // of the box that holds them
    f3 sum, once[3], twice[6];
};

static float along(f3 v, uint32_t axis)
{
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static f3 least(f3 a, f3 b)
{
    return f3_of(f_min(a.x, b.x), f_min(a.y, b.y), f_min(a.z, b.z));
}

static f3 most(f3 a, f3 b)
{
    return f3_of(f_max(a.x, b.x), f_max(a.y, b.y), f_max(a.z, b.z));
}

static f3 magnitude(f3 v)
{
    return most(v, f3_scale(v, -1));
}

static void enclose(struct bd_disk_part *part, f3 low, f3 high)
{
    part->middle = f3_scale(f3_add(low, high), 0.5f);
    part->half = f3_scale(f3_sub(high, low), 0.5f);
}

// The same moments about another middle (Steiner's theorem).
static void take_in(struct bd_disk_part *part, const struct bd_disk_part *of)
{
    const f3 moved = f3_sub(of->middle, part->middle);
    part->sum = f3_add(part->sum, of->sum);
    for (uint32_t a = 0; a < 3; a++)
        part->once[a] =
            f3_add(part->once[a], f3_add(of->once[a], f3_scale(of->sum, along(moved, a))));
    for (uint32_t i = 0; i < 6; i++) {
        const uint32_t a = PAIRS[i].a, b = PAIRS[i].b;
        const f3 once =
            f3_add(f3_scale(of->once[a], along(moved, b)), f3_scale(of->once[b], along(moved, a)));
        const f3 none = f3_scale(of->sum, along(moved, a) * along(moved, b));
        part->twice[i] = f3_add(part->twice[i], f3_add(of->twice[i], f3_add(once, none)));
    }
}

// --- building -----------------------------------------------------------------------------------

static f3 colour_of(const struct bd_disk_sums *sums, const struct bd_facing *facing,
                    const struct bd_point_node *node)
{
    return sums->colours ? sums->colours[facing->numbers[node->point]] : f3_of(1, 1, 1);
}

static struct bd_disk_part part_of_point(const struct bd_disk_sums *sums,
                                         const struct bd_facing *facing,
                                         const struct bd_point_node *node)
{
    return (struct bd_disk_part){.middle = node->position, .sum = colour_of(sums, facing, node)};
}

static void build_small(const struct bd_disk_sums *sums, const struct bd_facing *facing,
                        const struct bd_point_node *nodes, uint32_t count,
                        struct bd_disk_part *part)
{
    f3 low = nodes->position, high = low;
    for (uint32_t i = 1; i < count; i++) {
        low = least(low, nodes[i].position);
        high = most(high, nodes[i].position);
    }
    enclose(part, low, high);
    for (uint32_t i = 0; i < count; i++) {
        const struct bd_disk_part point = part_of_point(sums, facing, &nodes[i]);
        take_in(part, &point);
    }
}

// Parts are numbered as a heap's: those of `at` are 2 at + 1 and 2 at + 2. As point_tree divides.
static void build(const struct bd_disk_sums *sums, const struct bd_facing *facing,
                  const struct bd_point_node *nodes, uint32_t count, struct bd_disk_part *parts,
                  uint32_t at)
{
    const uint32_t middle = count / 2, behind = count - middle - 1;
    struct bd_disk_part *part = &parts[at];
    if (behind < PART_POINTS) {
        build_small(sums, facing, nodes, count, part);
        return;
    }
    const struct bd_disk_part *low = &parts[2 * at + 1], *high = &parts[2 * at + 2];
    const struct bd_disk_part point = part_of_point(sums, facing, &nodes[middle]);
    build(sums, facing, nodes, middle, parts, 2 * at + 1);
    build(sums, facing, nodes + middle + 1, behind, parts, 2 * at + 2);
    enclose(
        part,
        least(point.middle,
              least(f3_sub(low->middle, low->half), f3_sub(high->middle, high->half))),
        most(point.middle, most(f3_add(low->middle, low->half), f3_add(high->middle, high->half))));
    take_in(part, low);
    take_in(part, &point);
    take_in(part, high);
}

// Of the heap.
static uint32_t part_count_of(uint32_t points)
{
    uint32_t parts = 1;
    for (; points - points / 2 - 1 >= PART_POINTS; points /= 2) parts = 2 * parts + 1;
    return parts;
}

enum bd_err bd_disk_sums_init(struct bd_disk_sums *sums, const struct bd_facing_trees *trees,
                              const f3 *colours, struct bd_err_detail *detail)
{
    *sums = (struct bd_disk_sums){.trees = trees, .colours = colours};
    for (uint32_t f = 0; f < BD_FACINGS; f++) {
        const struct bd_facing *facing = &trees->facings[f];
        if (facing->tree.count == 0) continue;
        sums->parts[f] = calloc(part_count_of(facing->tree.count), sizeof **sums->parts);
        if (!sums->parts[f]) {
            bd_disk_sums_finish(sums);
            return bd_err_set(detail, BD_ERR_NO_MEMORY, "photons", "no memory for %u points",
                              trees->count);
        }
        build(sums, facing, facing->tree.nodes, facing->tree.count, sums->parts[f], 0);
    }
    return BD_ERR_OK;
}

void bd_disk_sums_finish(struct bd_disk_sums *sums)
{
    for (uint32_t f = 0; f < BD_FACINGS; f++) free(sums->parts[f]);
    *sums = (struct bd_disk_sums){0};
}

uint64_t bd_disk_sums_bytes(const struct bd_disk_sums *sums)
{
    uint64_t bytes = 0;
    for (uint32_t f = 0; f < BD_FACINGS; f++)
        if (sums->parts[f])
            bytes += part_count_of(sums->trees->facings[f].tree.count) * sizeof **sums->parts;
    return bytes;
}

// --- a disk -------------------------------------------------------------------------------------

struct walk {
    const struct bd_disk_sums *sums;
    const struct bd_disk *disk;
    const struct bd_disk_cut *cuts;
    struct bd_basis basis;
    f3 upright; // magnitudes of the normal's components
    // Of the facing that is asked.
    const struct bd_facing *facing;
    const struct bd_disk_part *parts;
    bool all_face;
    f3 sum;
    // Or who is shown each point.
    void (*look)(void *user, uint32_t number, float distance2);
    void *user;
};

static bool is_behind(const struct bd_disk_cut *cut, f3 position)
{
    return f3_dot(cut->normal, f3_sub(position, cut->point)) < 0;
}

// By what is met on either side of it.
static bool is_cut_off(const struct walk *w, f3 position)
{
    const f3 away = f3_sub(position, w->disk->position);
    const float turn = atan2f(f3_dot(away, w->basis.y), f3_dot(away, w->basis.x)) / (2 * F_PI);
    const float place = (turn < 0 ? turn + 1 : turn) * BD_DISK_CUTS;
    const uint32_t before = (uint32_t)place % BD_DISK_CUTS, after = (before + 1) % BD_DISK_CUTS;
    return is_behind(&w->cuts[before], position) || is_behind(&w->cuts[after], position);
}

static void add_point(struct walk *w, const struct bd_point_node *node)
{
    float distance2;
    if (!bd_disk_holds(w->disk, node, &distance2)) return;
    if (w->cuts && is_cut_off(w, node->position)) return;
    if (w->look) {
        w->look(w->user, w->facing->numbers[node->point], distance2);
        return;
    }
    const float weight = 1 - distance2 / w->disk->within2;
    w->sum = f3_add(w->sum, f3_scale(colour_of(w->sums, w->facing, node), weight));
}

// At least so far off are its points, squared.
static float distance2_of(const struct walk *w, const struct bd_disk_part *part)
{
    const f3 to = f3_sub(part->middle, w->disk->position);
    const f3 away = most(f3_sub(magnitude(to), part->half), f3_of(0, 0, 0));
    const float off = f_max(f_abs(f3_dot(to, w->disk->normal)) - f3_dot(part->half, w->upright), 0);
    const float farther = BD_DISK_OFF_PLANE * off;
    return f_max(f3_dot(away, away), farther * farther);
}

static bool is_uncut(const struct walk *w, const struct bd_disk_part *part)
{
    for (uint32_t i = 0; w->cuts && i < BD_DISK_CUTS; i++) {
        const struct bd_disk_cut *cut = &w->cuts[i];
        const float ahead = f3_dot(cut->normal, f3_sub(part->middle, cut->point));
        if (ahead < f3_dot(magnitude(cut->normal), part->half)) return false;
    }
    return true;
}

// Every corner of its box.
static bool is_whole_on(const struct walk *w, const struct bd_disk_part *part)
{
    const f3 to = f3_sub(part->middle, w->disk->position);
    const f3 away = f3_add(magnitude(to), part->half);
    const float off = f_abs(f3_dot(to, w->disk->normal)) + f3_dot(part->half, w->upright);
    const float farthest2 =
        f3_dot(away, away) + (BD_DISK_OFF_PLANE * BD_DISK_OFF_PLANE - 1) * off * off;
    return !w->look && w->all_face && farthest2 < w->disk->within2 && is_uncut(w, part);
}

// Squares of the distances from a place, and of those along a direction, are sums of moments.
static void add_part(struct walk *w, const struct bd_disk_part *part)
{
    const f3 to = f3_sub(part->middle, w->disk->position), up = w->disk->normal;
    const float off = f3_dot(to, up);
    f3 near = f3_scale(part->sum, f3_dot(to, to)), raised = f3_scale(part->sum, off * off);
    for (uint32_t a = 0; a < 3; a++) {
        near = f3_add(near, f3_scale(part->once[a], 2 * along(to, a)));
        raised = f3_add(raised, f3_scale(part->once[a], 2 * off * along(up, a)));
    }
    for (uint32_t i = 0; i < 6; i++) {
        const bool square = PAIRS[i].a == PAIRS[i].b;
        const float share = along(up, PAIRS[i].a) * along(up, PAIRS[i].b) * (square ? 1 : 2);
        if (square) near = f3_add(near, part->twice[i]);
        raised = f3_add(raised, f3_scale(part->twice[i], share));
    }
    const float farther = BD_DISK_OFF_PLANE * BD_DISK_OFF_PLANE - 1;
    const f3 distance2 = f3_add(near, f3_scale(raised, farther));
    w->sum = f3_add(w->sum, f3_sub(part->sum, f3_scale(distance2, 1 / w->disk->within2)));
}

static void visit(struct walk *w, const struct bd_point_node *nodes, uint32_t count, uint32_t at);

// The nearer part of both first: what is asked of the other may be less by then.
static void visit_both(struct walk *w, const struct bd_point_node *nodes, uint32_t count,
                       uint32_t at)
{
    const uint32_t middle = count / 2, behind = count - middle - 1;
    const uint32_t low = 2 * at + 1, high = 2 * at + 2;
    const float to_low = distance2_of(w, &w->parts[low]);
    const float to_high = distance2_of(w, &w->parts[high]);
    const bool low_first = to_low <= to_high;
    if (low_first && to_low < w->disk->within2) visit(w, nodes, middle, low);
    if (to_high < w->disk->within2) visit(w, nodes + middle + 1, behind, high);
    if (!low_first && to_low < w->disk->within2) visit(w, nodes, middle, low);
    add_point(w, &nodes[middle]);
}

static void visit(struct walk *w, const struct bd_point_node *nodes, uint32_t count, uint32_t at)
{
    if (is_whole_on(w, &w->parts[at])) {
        add_part(w, &w->parts[at]);
        return;
    }
    if (count - count / 2 - 1 >= PART_POINTS) {
        visit_both(w, nodes, count, at);
        return;
    }
    for (uint32_t i = 0; i < count; i++) add_point(w, &nodes[i]);
}

static bool are_any(const struct bd_disk_cut *cuts)
{
    float sum = 0;
    for (uint32_t i = 0; cuts && i < BD_DISK_CUTS; i++)
        sum += f3_dot(cuts[i].normal, cuts[i].normal);
    return sum > 0;
}

static void visit_all(struct walk *w, const struct bd_disk_cut *cuts)
{
    w->cuts = are_any(cuts) ? cuts : NULL;
    w->basis = bd_basis_of(w->disk->normal);
    w->upright = magnitude(w->disk->normal);
    for (uint32_t f = 0; f < BD_FACINGS; f++) {
        const struct bd_facing *facing = &w->sums->trees->facings[f];
        if (facing->tree.count == 0) continue;
        if (!bd_facing_has_alike(facing, w->disk->normal, BD_DISK_FACES_ALIKE)) continue;
        w->facing = facing;
        w->parts = w->sums->parts[f];
        w->all_face = bd_facing_is_alike(facing, w->disk->normal, BD_DISK_FACES_ALIKE);
        if (distance2_of(w, w->parts) < w->disk->within2)
            visit(w, facing->tree.nodes, facing->tree.count, 0);
    }
}

f3 bd_disk_sums_of(const struct bd_disk_sums *sums, const struct bd_disk *disk,
                   const struct bd_disk_cut *cuts)
{
    struct walk walk = {.sums = sums, .disk = disk};
    visit_all(&walk, cuts);
    return walk.sum;
}

void bd_disk_sums_each(const struct bd_disk_sums *sums, const struct bd_disk *disk,
                       const struct bd_disk_cut *cuts,
                       void (*look)(void *user, uint32_t number, float distance2), void *user)
{
    struct walk walk = {.sums = sums, .disk = disk, .look = look, .user = user};
    visit_all(&walk, cuts);
}
