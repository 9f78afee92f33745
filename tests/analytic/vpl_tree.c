// Trees of VPLs made by hand (pass/vpl_tree.h): every node is what its leaves sum up to, and what
// they send together lies between the node's bounds (shaders/kernel/vpl_tree.h).

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "kernel.h"
#include "pass/vpl_tree.h"
#include "shared/vpl.h"
#include "shared/vpl_tree.h"

// As the shaders store them.
struct leaf {
    struct bd_vec4 at[BD_VPL_VEC4S], quad[BD_VPL_QUAD_VEC4S];
};
struct node {
    struct bd_vec4 at[BD_TREE_NODE_VEC4S];
};

struct forest {
    uint32_t faces, root_side, leaf_side;
    struct leaf *leaves; // a grid a face, row by row
    struct node *nodes;
    uint32_t face_nodes, node_count;
};

static const bd_dvec3 light_at = {.1, -.2, .3};

// --- leaves made up -----------------------------------------------------------------------------

static double uniform(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(*state >> 40) / (double)(1 << 24);
}

static bd_dvec3 direction(uint64_t *state)
{
    double z = 2 * uniform(state) - 1, phi = 2 * M_PI * uniform(state), r = sqrt(1 - z * z);
    return (bd_dvec3){r * cos(phi), r * sin(phi), z};
}

static struct bd_vec4 vec4(bd_dvec3 v, double w)
{
    return (struct bd_vec4){(float)v.x, (float)v.y, (float)v.z, (float)w};
}

static bd_dvec3 dvec3(struct bd_vec4 v)
{
    return (bd_dvec3){v.x, v.y, v.z};
}

static struct leaf make_leaf(bd_dvec3 position, bd_dvec3 normal, double half, double flux)
{
    bd_dvec3 across = fabs(normal.x) < .7 ? (bd_dvec3){1, 0, 0} : (bd_dvec3){0, 1, 0};
    bd_dvec3 u = bd_dvec3_normalize(bd_dvec3_cross(normal, across), across);
    bd_dvec3 v = bd_dvec3_scale(bd_dvec3_cross(normal, u), 2 * half);
    double area = 8 * half * half;
    return (struct leaf){
        .at = {vec4(position, area),
               vec4(normal, 0),
               {(float)flux, (float)(.5 * flux), (float)(.25 * flux), 0}},
        .quad = {vec4(bd_dvec3_scale(u, half), 1 / area), vec4(v, 0)},
    };
}

// Leaves of a bumpy, speckled surface: `bump` is how far they stray from it, `tilt` their normals;
// one of `empty` is nothing.
static struct forest make_forest(uint32_t faces, uint32_t root_side, uint32_t leaf_side,
                                 double bump, double tilt, uint32_t empty, uint64_t seed)
{
    struct forest f = {.faces = faces, .root_side = root_side, .leaf_side = leaf_side};
    uint32_t count = faces * leaf_side * leaf_side;
    f.leaves = calloc(count, sizeof *f.leaves);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t face = i / (leaf_side * leaf_side), x = i % leaf_side;
        uint32_t y = i / leaf_side % leaf_side;
        bd_dvec3 at = {(x + .5) / leaf_side - .5, (y + .5) / leaf_side - .5, .2 * face - .5};
        at = bd_dvec3_add(at, bd_dvec3_scale(direction(&seed), bump * uniform(&seed)));
        bd_dvec3 normal = bd_dvec3_add((bd_dvec3){0, 0, 1}, bd_dvec3_scale(direction(&seed), tilt));
        normal = bd_dvec3_normalize(normal, (bd_dvec3){0, 0, 1});
        double flux = uniform(&seed) * uniform(&seed) + 1e-3;
        if (empty && (uint32_t)(uniform(&seed) * empty) == 0) continue;
        f.leaves[i] = make_leaf(at, normal, .4 / leaf_side, flux / leaf_side / leaf_side);
    }
    return f;
}

// --- the tree -----------------------------------------------------------------------------------

// Who builds it: NULL is the device.
static const struct bd_processor *builder;

static struct bd_buf *upload(struct bd_gpu *gpu, const struct forest *f, bool quads)
{
    const uint32_t count = f->faces * f->leaf_side * f->leaf_side;
    const size_t part = quads ? sizeof f->leaves->quad : sizeof f->leaves->at;
    char *bytes = malloc(count * part);
    for (uint32_t i = 0; i < count; i++)
        memcpy(bytes + i * part, quads ? f->leaves[i].quad : f->leaves[i].at, part);
    struct bd_buf *buf;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_buf_create(gpu, "leaves", count * part, bytes, &buf, &detail), BD_ERR_OK);
    free(bytes);
    return buf;
}

static void build(struct bd_gpu *gpu, struct forest *f)
{
    const struct bd_light lamp = {.color = {1, 1, 1}, .intensity = 1, .kind = BD_LIGHT_POINT};
    const struct bd_light_setup light = {
        .light = &lamp, .placement.position = light_at, .face_count = f->faces};
    const struct bd_render_space space = {.render_per_m = 1, .unit_cd_m2 = 1};
    struct bd_vpl_list list = {.vpls = upload(gpu, f, false),
                               .quads = upload(gpu, f, true),
                               .count = f->faces * f->leaf_side * f->leaf_side};
    const struct bd_vpl_tree_inputs inputs = {.leaves = &list,
                                              .leaf_side = f->leaf_side,
                                              .face_count = f->faces,
                                              .root_side = f->root_side,
                                              .light = &light,
                                              .space = &space};
    struct bd_slicer slicer = {0};
    bd_slicer_init(&slicer, gpu, NULL, NULL);
    const struct bd_pass_context context = {gpu, &slicer, builder};
    struct bd_vpl_tree *tree;
    struct bd_err_detail detail = {0};
    assert_int_equal(bd_vpl_tree_run(&context, &inputs, &tree, &detail), BD_ERR_OK);
    uint64_t bytes = bd_vpl_tree_bytes(tree);
    f->nodes = malloc(bytes);
    assert_int_equal(bd_buf_read(gpu, tree->nodes, 0, f->nodes, bytes), BD_ERR_OK);
    f->node_count = (uint32_t)(bytes / sizeof *f->nodes);
    f->face_nodes = bd_vpl_tree_level_first(tree, bd_vpl_tree_level_count(tree));
    assert_int_equal(f->node_count, f->face_nodes * f->faces);
    bd_vpl_tree_destroy(gpu, &tree);
    bd_buf_destroy(gpu, &list.vpls);
    bd_buf_destroy(gpu, &list.quads);
}

static void drop(struct forest *f)
{
    free(f->leaves);
    free(f->nodes);
}

// --- which leaves a node has ---------------------------------------------------------------------

struct block {
    uint32_t face, x, y, side; // leaves
};

static uint32_t even_bits(uint32_t n)
{
    uint32_t out = 0;
    for (int bit = 0; bit < 16; bit++) out |= (n >> (2 * bit) & 1) << bit;
    return out;
}

static struct block block_of(const struct forest *f, uint32_t node)
{
    struct block b = {.face = node / f->face_nodes, .side = f->leaf_side / f->root_side};
    uint32_t in_level = node % f->face_nodes, level_nodes = f->root_side * f->root_side;
    while (in_level >= level_nodes) {
        in_level -= level_nodes;
        level_nodes *= 4;
        b.side /= 2;
    }
    b.x = even_bits(in_level) * b.side;
    b.y = even_bits(in_level >> 1) * b.side;
    return b;
}

static const struct leaf *leaf_of(const struct forest *f, const struct block *b, uint32_t i)
{
    uint32_t x = b->x + i % b->side, y = b->y + i / b->side;
    return &f->leaves[(b->face * f->leaf_side + y) * f->leaf_side + x];
}

// --- sums ----------------------------------------------------------------------------------------

static void assert_near(double value, double expected, double tolerance, const char *what)
{
    if (fabs(value - expected) <= tolerance) return;
    fail_msg("%s: %.9g, expected %.9g", what, value, expected);
}

static void check_sums(const struct forest *f, uint32_t index)
{
    const struct node *n = &f->nodes[index];
    const struct block b = block_of(f, index);
    double flux = 0, area = 0, radiosity = 0, farthest2 = 0;
    bd_dvec3 position = {0}, normal = {0};
    for (uint32_t i = 0; i < b.side * b.side; i++) {
        const struct leaf *l = leaf_of(f, &b, i);
        if (!(l->at[2].x > 0)) continue;
        bd_dvec3 from_light = bd_dvec3_sub(dvec3(l->at[0]), light_at);
        flux += l->at[2].x;
        area += l->at[0].w;
        radiosity += l->at[2].x / l->at[0].w;
        position = bd_dvec3_add(position, bd_dvec3_scale(dvec3(l->at[0]), l->at[2].x));
        normal = bd_dvec3_add(normal, bd_dvec3_scale(dvec3(l->at[1]), l->at[2].x));
        farthest2 = fmax(farthest2, bd_dvec3_dot(from_light, from_light));
    }
    assert_near(n->at[2].x, flux, 1e-6 * flux, "flux");
    assert_near(n->at[2].y, .5 * flux, 1e-6 * flux, "green flux");
    assert_near(n->at[0].w, area, 1e-6 * area, "area");
    assert_near(n->at[2].w, radiosity, 1e-5 * radiosity, "radiosity");
    assert_near(n->at[3].w, farthest2, 1e-6 * farthest2, "distance from the light");
    if (!(flux > 0)) return;
    position = bd_dvec3_sub(dvec3(n->at[0]), bd_dvec3_scale(position, 1 / flux));
    normal = bd_dvec3_sub(dvec3(n->at[1]), bd_dvec3_scale(normal, 1 / flux));
    assert_near(bd_dvec3_dot(position, position), 0, 1e-12, "position");
    assert_near(bd_dvec3_dot(normal, normal), 0, 1e-12, "normal");
}

static bool in_box(const struct node *n, bd_dvec3 p)
{
    const double slack = 1e-6;
    return p.x >= n->at[3].x - slack && p.y >= n->at[3].y - slack && p.z >= n->at[3].z - slack &&
           p.x <= n->at[4].x + slack && p.y <= n->at[4].y + slack && p.z <= n->at[4].z + slack;
}

// Boxes hold the corners of the leaves' patches, cones their normals.
static void check_bounds(const struct forest *f, uint32_t index)
{
    const struct node *n = &f->nodes[index];
    const struct block b = block_of(f, index);
    for (uint32_t i = 0; i < b.side * b.side; i++) {
        const struct leaf *l = leaf_of(f, &b, i);
        if (!(l->at[2].x > 0)) continue;
        for (int k = 0; k < 4; k++) {
            bd_dvec3 u = bd_dvec3_scale(dvec3(l->quad[0]), k & 1 ? 1 : -1);
            bd_dvec3 v = bd_dvec3_scale(dvec3(l->quad[1]), k & 2 ? 1 : -1);
            assert_true(in_box(n, bd_dvec3_add(dvec3(l->at[0]), bd_dvec3_add(u, v))));
        }
        bd_dvec3 off = bd_dvec3_sub(dvec3(l->at[1]), dvec3(n->at[1]));
        assert_true(sqrt(bd_dvec3_dot(off, off)) <= n->at[1].w + 1e-6);
    }
}

static void nodes_sum_up_their_leaves(void **state)
{
    const uint32_t sides[][3] = {{1, 1, 1},   {1, 1, 16}, {1, 4, 16},
                                 {1, 16, 16}, {6, 1, 8},  {6, 4, 8}};
    for (size_t k = 0; k < sizeof sides / sizeof *sides; k++) {
        for (uint32_t empty = 0; empty <= 2; empty += 2) {
            struct forest f = make_forest(sides[k][0], sides[k][1], sides[k][2], .05, .5, empty, k);
            build(*state, &f);
            for (uint32_t i = 0; i < f.node_count; i++) {
                check_sums(&f, i);
                check_bounds(&f, i);
            }
            drop(&f);
        }
    }
}

// A floor and a wall on either side of x = 3/8: whatever nodes both are under, each is one lobe.
static struct forest make_corner(void)
{
    struct forest f = make_forest(1, 1, 8, 0, 0, 0, 11);
    for (uint32_t i = 0; i < 64; i++) {
        double x = i % 8, y = i / 8, flux = f.leaves[i].at[2].x;
        bool wall = x >= 3;
        bd_dvec3 at = {fmin(x, 3) / 8, y / 8, wall ? (x - 3) / 8 : 0};
        f.leaves[i] = make_leaf(at, wall ? (bd_dvec3){-1, 0, 0} : (bd_dvec3){0, 0, 1}, .01, flux);
    }
    return f;
}

static void two_surfaces_are_two_lobes(void **state)
{
    struct forest f = make_corner();
    build(*state, &f);
    double share[2] = {0};
    bd_dvec3 mean[2] = {{0, 0, 0}, {0, 0, 0}};
    for (uint32_t i = 0; i < 64; i++) {
        bool wall = i % 8 >= 3;
        share[wall] += f.leaves[i].at[2].x / f.nodes[0].at[2].x;
        mean[wall] =
            bd_dvec3_add(mean[wall], bd_dvec3_scale(dvec3(f.leaves[i].at[0]), f.leaves[i].at[2].x));
    }
    const struct bd_vec4 *first = &f.nodes[0].at[5], *normal = &f.nodes[0].at[6];
    bool wall = normal->x < -.1f;
    assert_near(first->w, share[wall], 1e-6, "share");
    assert_near(normal->x, wall ? -share[1] : 0, 1e-6, "normal along x");
    assert_near(normal->z, wall ? 0 : share[0], 1e-6, "normal along z");
    mean[wall] = bd_dvec3_scale(mean[wall], 1 / share[wall] / f.nodes[0].at[2].x);
    bd_dvec3 off = bd_dvec3_sub(dvec3(*first), mean[wall]);
    assert_near(bd_dvec3_dot(off, off), 0, 1e-12, "position");
    drop(&f);
}

// --- the bound -----------------------------------------------------------------------------------

struct query {
    struct node node;
    struct bd_vec4 position, normal;
};

struct range {
    double least, most;
};

// What a leaf sends by the disk kernel, and by the patch that it is.
static struct range leaf_irradiance(const struct leaf *l, bd_dvec3 at, bd_dvec3 n)
{
    if (!(l->at[2].x > 0)) return (struct range){0};
    bd_dvec3 to = bd_dvec3_sub(dvec3(l->at[0]), at);
    double r2 = bd_dvec3_dot(to, to), patch = 0;
    double cosines = fmax(bd_dvec3_dot(n, to), 0) * fmax(-bd_dvec3_dot(dvec3(l->at[1]), to), 0);
    double disk = l->at[2].x * cosines / (r2 * (M_PI * r2 + l->at[0].w));
    for (int i = 0; i < 16 * 16; i++) {
        double s = (i % 16 + .5) / 8 - 1, t = (i / 16 + .5) / 8 - 1;
        bd_dvec3 p = bd_dvec3_add(to, bd_dvec3_add(bd_dvec3_scale(dvec3(l->quad[0]), s),
                                                   bd_dvec3_scale(dvec3(l->quad[1]), t)));
        double p2 = bd_dvec3_dot(p, p);
        cosines = fmax(bd_dvec3_dot(n, p), 0) * fmax(-bd_dvec3_dot(dvec3(l->at[1]), p), 0);
        // A cell nearer than its own size is no point: it is at most the form factor 1 altogether.
        patch += fmin(l->at[2].x / 256 * cosines / (M_PI * p2 * p2), l->at[2].x / l->at[0].w);
    }
    patch = fmin(patch, l->at[2].x / l->at[0].w);
    return (struct range){fmin(disk, patch), fmax(disk, patch)};
}

static struct range leaves_irradiance(const struct forest *f, uint32_t node, bd_dvec3 at,
                                      bd_dvec3 n)
{
    const struct block b = block_of(f, node);
    struct range sum = {0};
    for (uint32_t i = 0; i < b.side * b.side; i++) {
        struct range leaf = leaf_irradiance(leaf_of(f, &b, i), at, n);
        sum.least += leaf.least;
        sum.most += leaf.most;
    }
    return sum;
}

// Somewhere around a node: far, in its box, or just over one of its leaves.
static bd_dvec3 place_near(const struct forest *f, uint32_t node, uint64_t *seed)
{
    const struct node *n = &f->nodes[node];
    const struct block b = block_of(f, node);
    double kind = uniform(seed);
    if (kind < .4) {
        bd_dvec3 off = direction(seed);
        off.z = fabs(off.z);
        return bd_dvec3_add(dvec3(n->at[0]), bd_dvec3_scale(off, pow(10, 2 * uniform(seed) - 1)));
    }
    if (kind < .7)
        return (bd_dvec3){n->at[3].x + uniform(seed) * (n->at[4].x - n->at[3].x),
                          n->at[3].y + uniform(seed) * (n->at[4].y - n->at[3].y),
                          n->at[3].z + uniform(seed) * (n->at[4].z - n->at[3].z)};
    const struct leaf *l = leaf_of(f, &b, (uint32_t)(uniform(seed) * b.side * b.side));
    double height = sqrt(l->at[0].w) * pow(10, 2 * uniform(seed) - 2);
    return bd_dvec3_add(dvec3(l->at[0]), bd_dvec3_scale(dvec3(l->at[1]), height));
}

#define QUERIES_PER_NODE 12

static void check_forest(struct bd_gpu *gpu, struct forest *f, uint64_t seed)
{
    build(gpu, f);
    uint32_t count = f->node_count * QUERIES_PER_NODE;
    struct query *queries = calloc(count, sizeof *queries);
    struct bd_vec4 *bounds = calloc(count, sizeof *bounds);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t node = i / QUERIES_PER_NODE;
        bd_dvec3 at = f->nodes[node].at[2].x > 0 ? place_near(f, node, &seed) : direction(&seed);
        queries[i] = (struct query){f->nodes[node], vec4(at, 0), vec4(direction(&seed), 0)};
    }
    kernel_run(gpu, "test/tree_bound.comp", (count + 63) / 64, queries, count * sizeof *queries,
               bounds, count * sizeof *bounds);
    uint32_t lit = 0, sure = 0;
    for (uint32_t i = 0; i < count; i++) {
        struct range sum = leaves_irradiance(f, i / QUERIES_PER_NODE, dvec3(queries[i].position),
                                             dvec3(queries[i].normal));
        double rounding = 1e-4 * sum.most + 1e-6 * queries[i].node.at[2].w;
        if (bounds[i].x < sum.most - rounding || bounds[i].y > sum.least + rounding)
            fail_msg("node %u: %.6g to %.6g, bounds %.6g to %.6g", i / QUERIES_PER_NODE, sum.least,
                     sum.most, (double)bounds[i].y, (double)bounds[i].x);
        lit += sum.most > 0;
        sure += bounds[i].y > 0;
    }
    assert_true(lit > count / 8 && sure > count / 32);
    print_message("    %u nodes, %u receivers, %u of them lit, %u of them surely\n", f->node_count,
                  count, lit, sure);
    free(queries);
    free(bounds);
}

static void bounds_hold(void **state)
{
    const double shapes[][2] = {{0, 0}, {.05, .3}, {.3, 2}, {.01, .1}};
    for (size_t k = 0; k < sizeof shapes / sizeof *shapes; k++) {
        struct forest f = make_forest(1, 1, 8, shapes[k][0], shapes[k][1], 4, k + 7);
        check_forest(*state, &f, k);
        drop(&f);
    }
}

static double bound_at(struct bd_gpu *gpu, const struct node *node, bd_dvec3 at, bd_dvec3 normal)
{
    const struct query query = {*node, vec4(at, 0), vec4(normal, 0)};
    struct bd_vec4 bound;
    kernel_run(gpu, "test/tree_bound.comp", 1, &query, sizeof query, &bound, sizeof bound);
    return bound.x;
}

// Four patches one behind the other send more than the radiosity of any of them: without occlusion
// each fills most of the view of the point before it.
static void overlapping_patches_are_bounded(void **state)
{
    struct forest f = make_forest(1, 1, 2, 0, 0, 0, 3);
    for (int k = 0; k < 4; k++)
        f.leaves[k] = make_leaf((bd_dvec3){0, 0, -1e-3 * k}, (bd_dvec3){0, 0, 1}, .5, 1);
    build(*state, &f);
    const bd_dvec3 at = {0, 0, .3}, normal = {0, 0, -1};
    double sum = leaves_irradiance(&f, 0, at, normal).most, one = 1 / f.leaves[0].at[0].w;
    double bound = bound_at(*state, &f.nodes[0], at, normal);
    print_message("    four patches send %.3f, bound %.3f, each has a radiosity of %.3f\n", sum,
                  bound, one);
    assert_true(sum > 1.5 * one);
    assert_true(bound >= sum);
    drop(&f);
}

// Far away and face to face the bound is what is sent; behind either's back it is nothing.
static void bound_is_tight_far_away(void **state)
{
    struct forest f = make_forest(1, 1, 8, 0, 0, 0, 5);
    build(*state, &f);
    const bd_dvec3 before = {0, 0, 30}, behind = {0, 0, -30}, up = {0, 0, 1}, back = {0, 0, -1};
    double sum = leaves_irradiance(&f, 0, before, back).most;
    assert_near(bound_at(*state, &f.nodes[0], before, back) / sum, 1, .1, "bound over sum");
    assert_near(bound_at(*state, &f.nodes[0], before, up), 0, 0, "receiver turned away");
    assert_near(bound_at(*state, &f.nodes[0], behind, up), 0, 0, "senders turned away");
    drop(&f);
}

// Where the device divides by its own rule, the last bit may be another.
static void both_build_the_same_tree(void **state)
{
    struct forest device = make_forest(6, 2, 16, .05, .5, 3, 17), native = device;
    const struct bd_processor *processor = builder;
    build(*state, &native);
    builder = NULL;
    build(*state, &device);
    builder = processor;
    double most = 0;
    for (uint32_t i = 0; i < device.node_count; i++) {
        const float *a = &device.nodes[i].at[0].x, *b = &native.nodes[i].at[0].x;
        for (size_t k = 0; k < 4 * BD_TREE_NODE_VEC4S; k++)
            most = fmax(most, fabs((double)a[k] - b[k]) / fmax(1, fabs((double)a[k])));
    }
    print_message("    %u nodes, at most %.2g apart\n", device.node_count, most);
    assert_true(most < 1e-5);
    free(native.nodes);
    drop(&device);
}

static int open_both(void **state)
{
    static struct bd_processor processor;
    const int failed = kernel_open_device(state);
    processor = (struct bd_processor){bd_pool_create(0), bd_native_loops()};
    builder = &processor;
    return failed;
}

static int close_both(void **state)
{
    struct bd_pool *pool = builder->pool;
    bd_pool_destroy(&pool);
    builder = NULL;
    return kernel_close_device(state);
}

#define TESTS                                                                                      \
    cmocka_unit_test(nodes_sum_up_their_leaves), cmocka_unit_test(two_surfaces_are_two_lobes),     \
        cmocka_unit_test(bounds_hold), cmocka_unit_test(overlapping_patches_are_bounded),          \
        cmocka_unit_test(bound_is_tight_far_away)

int main(void)
{
    const struct CMUnitTest device[] = {TESTS};
    const struct CMUnitTest native[] = {TESTS, cmocka_unit_test(both_build_the_same_tree)};
    return cmocka_run_group_tests(device, kernel_open_device, kernel_close_device) +
           cmocka_run_group_tests(native, open_both, close_both);
}
