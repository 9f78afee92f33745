// Gather over a cut of a light's tree of VPLs, one cut a receiver (algorithms.md A2.4): a node
// stands for all leaves below it where the criterion says that it may.
//
// Depth first, in Morton order, without a stack: the place in the tree is a level and an index.
//
// A receiver visits only so many nodes in a round, and stops at a root's end: a software device ends
// loops that are too long. Where it is to go on is kept, and that somebody has not finished.
//
// image 0: irradiance, demodulated; image 1 (BD_GLOSSY): see common/vpl_gather.glsl.
// BD_PRINTED: Eqs. 1 to 6 of the paper, with their errors.
// BD_ESTIMATE: adds what the roots by themselves send to each receiver's estimate; no images.
// BD_FRAGMENTS: a receiver is a block of pixels of a list (images 0 and 1: level 0, the rest; with
// BD_VECTOR 2 and 3: the irradiance vector), else a pixel.
// BD_SPREAD: also how far off light that is interpolated over the block may be, in a of image 3.
#include "common/tree_walk.glsl"
#ifdef BD_FRAGMENTS
#include "common/block_receiver.glsl" // last: what it includes and others do is above
#endif

#ifdef BD_FRAGMENTS
layout(local_size_x = 64) in;
layout(std430, binding = BD_STORAGE_FRAGMENTS) readonly buffer fragments_block { uint fragments[]; };
#else
layout(local_size_x = 8, local_size_y = 8) in;
#endif
#ifndef BD_ESTIMATE
layout(binding = 0, rgba32f) uniform image2D light_0;
#if defined(BD_FRAGMENTS) || defined(BD_GLOSSY)
layout(binding = 1, rgba32f) uniform image2D light_1;
#endif
#ifdef BD_VECTOR
layout(binding = 2, rgba32f) uniform image2D vector_0;
layout(binding = 3, rgba32f) uniform image2D vector_1;
#endif
#endif

#ifndef BD_ESTIMATE
const uint NONE = 0xffffffffu;

// Goes on to the end or to the first leaf that is near enough to be integrated as a patch, whose
// index it returns: a software device runs both sides of every branch, and that formula here would
// cost several times the rest.
uint go_on(inout sums s, receiver r, vec3 viewer, inout walk w, float estimate)
{
    cut_node c;
    while (w.at.root < w.end) {
        if (!takes_next(r, w, estimate, c)) continue;
        bool lit = c.bounds.most > 0.0;
#ifdef BD_SPREAD
        if (lit)
            add_spread(s.spread, r.normal_geometric, c.to_node, c.r2, vec4(c.n.normal, c.n.area),
                       all_channels(c.n.flux));
#endif
#ifdef BD_VPL_PATCH
        if (lit && is_near(c)) return leaf_index(c.at);
#endif
        node_light l = light_of(r, c.n, c.at.level, c.bounds.most);
        if (lit) add(s, r, viewer, l.direction, dot(l.direction, l.direction), l.irradiance);
    }
    return NONE;
}

// The root to go on from in the next round.
uint gather(inout sums s, receiver r, vec3 viewer, uint first_root, float estimate)
{
    walk w = walk_from(first_root);
    if (!r.lit) return w.end;
    while (w.at.root < w.end) {
        uint leaf = go_on(s, r, viewer, w, estimate);
#ifdef BD_VPL_PATCH
        while (leaf != NONE) {
            add_patch(s, r, viewer, leaf);
            leaf = NONE;
        }
#endif
    }
    return w.at.root;
}
#endif

// What earlier roots and lights left there. Macros, since no function may be given an image with a
// format.
#define EARLIER(image, at) (tree_args.is_first != 0u ? vec3(0.0) : imageLoad(image, at).rgb)
#define ADD(image, at, sum) imageStore(image, at, vec4((sum) + EARLIER(image, at), 1.0))

#ifndef BD_ESTIMATE
#ifdef BD_FRAGMENTS
#ifdef BD_SPREAD
vec4 earlier_vector(ivec2 at) { return imageLoad(vector_1, at); }
#elif defined(BD_VECTOR)
vec4 earlier_vector(ivec2 at) { return vec4(imageLoad(vector_1, at).rgb, 0.0); }
#endif

void keep(sums s, receiver r, uint level, ivec2 block)
{
    ivec2 at = level == 0u ? block : in_stack(level, block);
    if (level == 0u) ADD(light_0, at, s.diffuse);
    else ADD(light_1, at, s.diffuse);
#ifdef BD_VECTOR
    vec4 vector = vec4(irradiance_vector(s, r.normal), 1.0);
#ifdef BD_SPREAD
    vector.a = s.spread.sum;
#endif
    if (level == 0u) ADD(vector_0, at, vector.rgb);
    else imageStore(vector_1, at, tree_args.is_first != 0u ? vector : vector + earlier_vector(at));
#endif
}
#else
void keep(sums s, receiver r, uint level, ivec2 pixel)
{
    ADD(light_0, pixel, s.diffuse);
#ifdef BD_GLOSSY
    ADD(light_1, pixel, s.glossy);
#endif
}
#endif
#endif

#ifdef BD_ESTIMATE
void light_receiver(receiver r, uint index, uint level, ivec2 block)
{
    uint steps = r.lit ? estimated_steps(r) : 0u;
    estimates[index] = tree_args.is_first != 0u ? steps : estimates[index] + steps;
}

bool is_done(uint index) { return false; }
#else
void light_receiver(receiver r, uint index, uint level, ivec2 block)
{
    sums s = no_light();
#ifdef BD_SPREAD
    s.spread = spread_of_block(level, r, tree_args.finest_level);
#endif
    float estimate = estimate_of(index);
    uint first_root = tree_args.is_resumed == 0u ? tree_args.first_root : next_roots[index];
    uint next_root = gather(s, r, direction_to_viewer(r.relative_position), first_root, estimate);
    keep(s, r, level, block);
    next_roots[index] = next_root;
    if (next_root < tree_args.first_root + tree_args.root_count) unfinished_round = tree_args.round;
}

// In an earlier round.
bool is_done(uint index)
{
    return tree_args.is_resumed != 0u && next_roots[index] >= tree_args.first_root + tree_args.root_count;
}
#endif

void main()
{
#ifdef BD_FRAGMENTS
    if (gl_GlobalInvocationID.x >= tree_args.fragment_count) return;
    uint index = tree_args.first_fragment + gl_GlobalInvocationID.x, fragment = fragments[index];
    uint level = BD_FRAGMENT_LEVEL(fragment);
    ivec2 block = ivec2(BD_FRAGMENT_X(fragment), BD_FRAGMENT_Y(fragment));
    if (is_done(index)) return;
    light_receiver(block_receiver(level, block), index, level, block);
#else
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(tree_args.first_column, tree_args.first_row);
    if (gl_GlobalInvocationID.x >= tree_args.column_count || gl_GlobalInvocationID.y >= tree_args.row_count) return;
    uint index = uint(pixel.y) * view.size_px.x + uint(pixel.x);
    if (is_done(index)) return;
    light_receiver(gbuffer_receiver(pixel), index, 0u, pixel);
#endif
}
