#include "rays/nodes.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/huge_pages.h"
#include "rays/cutout_table.h"
#include "rays/structure.h"

#define LEAF_MAX 4u
_Static_assert(LEAF_MAX < BD_RAY_LEAF_COUNTS, "a leaf's word");
_Static_assert(sizeof(struct bd_ray_triangle) <= 2 * sizeof(struct bd_ray_node), "look_at()");
// No tree that 32 bits allow is as deep: boxes that halve at every level come to an end.
#define DEPTH_MAX 1024
// Of the largest coordinate, by which boxes are larger than their triangles.
#define BOX_MARGIN 4.8e-7f
// As Embree: triangles beyond are left out.
#define REACH 1.844e18f

// As Embree builds it: wherever its threads found memory.
struct knot {
    uint32_t count; // of triangles; 0: two children
    union {
        struct knot *children[2];
        uint32_t triangles[LEAF_MAX]; // of the placed
    };
};

struct making {
    const struct bd_rays *placed;
    const struct bd_rays_level *level; // of all triangles, placed
    struct bd_rays_watch watch;
    struct RTCBuildPrimitive *boxes;
    uint32_t box_count;
    _Atomic uint32_t leaf_count;
    struct bd_ray_nodes *out;
};

// --- what Embree is given -----------------------------------------------------------------------

// Triangles go by their place among the opaque, and the others behind those.
static const struct bd_placed_triangles *find(const struct making *making, uint32_t *triangle)
{
    const struct bd_placed_triangles *placed = making->level->placed;
    if (*triangle < placed[BD_PLACED_OPAQUE].triangle_count) return &placed[BD_PLACED_OPAQUE];
    *triangle -= (uint32_t)placed[BD_PLACED_OPAQUE].triangle_count;
    return &placed[BD_PLACED_CUTOUT];
}

static uint32_t count_triangles(const struct making *making)
{
    return (uint32_t)(making->level->placed[BD_PLACED_OPAQUE].triangle_count +
                      making->level->placed[BD_PLACED_CUTOUT].triangle_count);
}

static const float *corner_of(const struct making *making, uint32_t triangle, int corner)
{
    const struct bd_placed_triangles *placed = find(making, &triangle);
    return placed->positions + 3 * (size_t)placed->indices[3 * (size_t)triangle + (size_t)corner];
}

static bool box_of(const struct making *making, uint32_t triangle, float least[3], float most[3])
{
    bool is_within = true;
    for (int axis = 0; axis < 3; axis++) {
        least[axis] = INFINITY, most[axis] = -INFINITY;
        for (int corner = 0; corner < 3; corner++) {
            const float at = corner_of(making, triangle, corner)[axis];
            is_within = is_within && fabsf(at) < REACH;
            least[axis] = fminf(least[axis], at), most[axis] = fmaxf(most[axis], at);
        }
    }
    return is_within;
}

static void list_boxes(struct making *making, uint32_t triangle_count)
{
    for (uint32_t t = 0; t < triangle_count; t++) {
        float least[3], most[3];
        if (!box_of(making, t, least, most)) continue;
        making->boxes[making->box_count++] = (struct RTCBuildPrimitive){
            .lower_x = least[0],
            .lower_y = least[1],
            .lower_z = least[2],
            .upper_x = most[0],
            .upper_y = most[1],
            .upper_z = most[2],
            .primID = t,
        };
    }
}

// --- what it calls, from any of its threads -----------------------------------------------------

static void *create_inner(RTCThreadLocalAllocator allocator, unsigned int count, void *user)
{
    (void)user;
    BD_ASSERT_CMP(count, ==, 2);
    struct knot *knot = rtcThreadLocalAlloc(allocator, sizeof *knot, 16);
    knot->count = 0;
    return knot;
}

static void set_children(void *node, void **children, unsigned int count, void *user)
{
    (void)user;
    struct knot *knot = node;
    for (unsigned int c = 0; c < count; c++) knot->children[c] = children[c];
}

// Boxes follow from the triangles, once they are in their order.
static void set_bounds(void *node, const struct RTCBounds **bounds, unsigned int count, void *user)
{
    (void)node, (void)bounds, (void)count, (void)user;
}

static void *create_leaf(RTCThreadLocalAllocator allocator, const struct RTCBuildPrimitive *boxes,
                         size_t count, void *user)
{
    struct making *making = user;
    BD_ASSERT(count > 0 && count <= LEAF_MAX);
    atomic_fetch_add_explicit(&making->leaf_count, 1, memory_order_relaxed);
    struct knot *knot = rtcThreadLocalAlloc(allocator, sizeof *knot, 16);
    knot->count = (uint32_t)count;
    for (uint32_t i = 0; i < knot->count; i++) {
        uint32_t at = i;
        for (; at > 0 && knot->triangles[at - 1] > boxes[i].primID; at--)
            knot->triangles[at] = knot->triangles[at - 1];
        knot->triangles[at] = boxes[i].primID;
    }
    return knot;
}

static bool go_on(void *user, double share)
{
    return bd_rays_go_on(&((struct making *)user)->watch, share);
}

static struct knot *build_tree(struct making *making, RTCBVH tree)
{
    struct RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.maxDepth = DEPTH_MAX;
    arguments.maxLeafSize = LEAF_MAX;
    arguments.bvh = tree;
    arguments.primitives = making->boxes;
    arguments.primitiveCount = arguments.primitiveArrayCapacity = making->box_count;
    arguments.createNode = create_inner;
    arguments.setNodeChildren = set_children;
    arguments.setNodeBounds = set_bounds;
    arguments.createLeaf = create_leaf;
    arguments.buildProgress = go_on;
    arguments.userPtr = making;
    return rtcBuildBVH(&arguments);
}

// --- as a device walks it -----------------------------------------------------------------------

// All are placed: one of a mirrored instance has its winding turned round.
static uint32_t back_of(const struct making *making, uint32_t number)
{
    const struct bd_scene *scene = making->placed->scene;
    uint32_t triangle;
    const struct bd_triangle_run *run = bd_rays_run(making->placed, number, &triangle);
    const int32_t material = scene->meshes[run->mesh]->primitives[run->primitive].material;
    if (scene->materials[material].double_sided) return BD_RAY_BACK_NONE;
    return run->mirrored ? BD_RAY_BACK_AGAINST : BD_RAY_BACK_BEFORE;
}

static void add_triangle(struct making *making, uint32_t triangle)
{
    struct bd_ray_triangle *to = &making->out->triangles[making->out->triangle_count++];
    uint32_t place = triangle;
    const struct bd_placed_triangles *placed = find(making, &place);
    const uint32_t number = placed->numbers[place];
    *to = (struct bd_ray_triangle){.number = number, .back = back_of(making, number)};
    if (placed == &making->level->placed[BD_PLACED_CUTOUT]) to->cutout = 1 + place;
    memcpy(to->a, corner_of(making, triangle, 0), sizeof to->a);
    memcpy(to->b, corner_of(making, triangle, 1), sizeof to->b);
    memcpy(to->c, corner_of(making, triangle, 2), sizeof to->c);
}

// Nodes before what is below them, the first child's before the second's.
static void flatten(struct making *making, const struct knot *root)
{
    struct bd_ray_nodes *out = making->out;
    const struct knot *stack[DEPTH_MAX + 2] = {root};
    for (uint32_t depth = 1; depth > 0 && bd_rays_go_on(&making->watch, 1);) {
        const struct knot *knot = stack[--depth];
        struct bd_ray_node *node = &out->nodes[out->node_count++];
        const uint32_t first = knot->count ? out->triangle_count : 0;
        node->leaf = first * BD_RAY_LEAF_COUNTS + knot->count;
        for (uint32_t t = 0; t < knot->count; t++) add_triangle(making, knot->triangles[t]);
        if (knot->count) continue;
        BD_ASSERT_CMP(depth, <=, DEPTH_MAX);
        stack[depth++] = knot->children[1];
        stack[depth++] = knot->children[0];
    }
}

static void widen(struct bd_ray_node *node, const float least[3], const float most[3])
{
    for (int axis = 0; axis < 3; axis++) {
        node->least[axis] = fminf(node->least[axis], least[axis]);
        node->most[axis] = fmaxf(node->most[axis], most[axis]);
    }
}

static void finish_leaf(const struct bd_ray_nodes *nodes, struct bd_ray_node *node)
{
    const uint32_t first = node->leaf / BD_RAY_LEAF_COUNTS, count = node->leaf % BD_RAY_LEAF_COUNTS;
    for (uint32_t t = first; t < first + count; t++) {
        const struct bd_ray_triangle *triangle = &nodes->triangles[t];
        widen(node, triangle->a, triangle->a);
        widen(node, triangle->b, triangle->b);
        widen(node, triangle->c, triangle->c);
    }
    float largest = 0;
    for (int axis = 0; axis < 3; axis++)
        largest = fmaxf(largest, fmaxf(fabsf(node->least[axis]), fabsf(node->most[axis])));
    for (int axis = 0; axis < 3; axis++) {
        node->least[axis] -= BOX_MARGIN * largest;
        node->most[axis] += BOX_MARGIN * largest;
    }
}

// From the last node on: what is below a node comes before it.
static void finish_nodes(const struct bd_ray_nodes *nodes)
{
    for (uint32_t n = nodes->node_count; n-- > 0;) {
        struct bd_ray_node *node = &nodes->nodes[n];
        for (int axis = 0; axis < 3; axis++)
            node->least[axis] = INFINITY, node->most[axis] = -INFINITY;
        node->skip = n + 1;
        if (node->leaf) {
            finish_leaf(nodes, node);
            continue;
        }
        const struct bd_ray_node *first = node + 1, *second = &nodes->nodes[first->skip];
        widen(node, first->least, first->most);
        widen(node, second->least, second->most);
        node->skip = second->skip;
    }
}

static bool make_room(struct making *making, uint32_t leaf_count)
{
    making->out->nodes =
        bd_huge_pages_alloc((2 * (size_t)leaf_count - 1) * sizeof *making->out->nodes);
    making->out->triangles =
        bd_huge_pages_alloc(making->box_count * sizeof *making->out->triangles);
    return making->out->nodes && making->out->triangles;
}

// --- all of it ----------------------------------------------------------------------------------

static enum bd_err no_memory(const struct making *making, struct bd_err_detail *detail)
{
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "scene", "no memory for a tree of %u triangles",
                      count_triangles(making));
}

static enum bd_err build_nodes(struct making *making, struct bd_err_detail *detail)
{
    RTCBVH tree = rtcNewBVH(making->level->part->device->embree);
    const struct knot *root = build_tree(making, tree);
    enum bd_err err = bd_rays_built(making->level->part, &making->watch, detail);
    if (!err && !make_room(making, atomic_load(&making->leaf_count)))
        err = no_memory(making, detail);
    if (!err) {
        flatten(making, root);
        err = bd_rays_built(making->level->part, &making->watch, detail);
    }
    if (!err) finish_nodes(making->out);
    rtcReleaseBVH(tree);
    return err;
}

static enum bd_err make_nodes(struct making *making, struct bd_err_detail *detail)
{
    const uint32_t count = count_triangles(making);
    making->boxes = bd_huge_pages_alloc((count + 1) * sizeof *making->boxes);
    if (!making->boxes) return no_memory(making, detail);
    list_boxes(making, count);
    const enum bd_err err = making->box_count ? build_nodes(making, detail) : BD_ERR_OK;
    free(making->boxes);
    return err;
}

// Whether the scene is one for a device.
static enum bd_err look_at(const struct bd_scene *scene, uint64_t bytes_max,
                           struct bd_err_detail *detail)
{
    // Of a triangle: the most nodes that a tree has for it.
    const uint64_t fitting = bytes_max / (2 * sizeof(struct bd_ray_node));
    const uint64_t most =
        fitting < BD_RAY_NODES_TRIANGLES_MAX ? fitting : BD_RAY_NODES_TRIANGLES_MAX;
    if (scene->features.triangle_count <= most) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_UNSUPPORTED, "scene",
                      "%llu triangles, instanced; the device takes %llu",
                      (unsigned long long)scene->features.triangle_count, (unsigned long long)most);
}

enum bd_err bd_ray_nodes_create(struct bd_scene *scene, const struct bd_rays_build *build,
                                uint64_t bytes_max, struct bd_ray_nodes **out,
                                struct bd_err_detail *detail)
{
    struct bd_rays *placed = NULL;
    const struct bd_rays_build all = {build->thread_count, UINT64_MAX, build->should_stop,
                                      build->user};
    const struct bd_rays_wish wish = {.is_only_placed = true};
    struct making making = {.watch = {.build = &all}};
    *out = NULL;
    enum bd_err err = look_at(scene, bytes_max, detail);
    if (!err) err = bd_rays_begin(scene, &all, &placed, detail);
    if (!err) err = bd_rays_add_built(placed, &wish, &all, detail);
    if (!err) {
        making.placed = placed;
        making.level = &placed->levels[0];
        making.out = *out = calloc(1, sizeof **out);
        BD_ASSERT(making.out);
        err = make_nodes(&making, detail);
    }
    if (!err) err = bd_cutout_table_make(placed, bytes_max, making.out, detail);
    bd_rays_destroy(&placed);
    if (err) bd_ray_nodes_destroy(out);
    return err;
}

void bd_ray_nodes_destroy(struct bd_ray_nodes **nodes)
{
    if (!*nodes) return;
    free((*nodes)->nodes);
    free((*nodes)->triangles);
    free((*nodes)->cutouts);
    free((*nodes)->texels);
    free(*nodes);
    *nodes = NULL;
}
