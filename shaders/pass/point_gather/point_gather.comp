// Light of points of all surfaces (server/pass/point_gather.h): whoever asks has a work group, which
// weighs clusters, draws points of them into a map of BD_SIDE x BD_SIDE texels that it shares, sums
// what texels keep, and draws rays through them. Whole numbers decide who is drawn and kept: no order of threads shows.
#include "kernel/brdf.h"
#include "kernel/light_spread.h"
#include "kernel/map_rays.h"
#include "kernel/point_draws.h"
#include "kernel/projected_point.h"
#include "kernel/vpl_light.h"
#include "shared/bindings.h"
#include "shared/projected_points.h"

#define THREADS 128u
layout(local_size_x = 128) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_point_gather_args args; };
layout(std430, binding = BD_STORAGE_POINTS) readonly buffer point_block { uvec4 points[]; };
layout(std430, binding = BD_STORAGE_POINT_NAMES) readonly buffer name_block { uint names[]; };
layout(std430, binding = BD_STORAGE_POINT_RADIANCE) readonly buffer radiance_block { float radiance[]; };
layout(std430, binding = BD_STORAGE_POINT_TEXELS) readonly buffer texel_block { vec4 texels[]; };
layout(std430, binding = BD_STORAGE_POINT_CLUSTERS) readonly buffer cluster_block { uvec4 clusters[]; };
layout(std430, binding = BD_STORAGE_POINT_ASKERS) readonly buffer asker_block { uvec4 askers[]; };
layout(std430, binding = BD_STORAGE_POINT_LIGHT) writeonly buffer light_block { uvec4 light[]; };
#ifdef BD_LOBES
layout(std430, binding = BD_STORAGE_POINT_LOBES) readonly buffer lobe_block { uint lobes[]; };
#endif

#define TEXELS       (uint(BD_SIDE) * uint(BD_SIDE))
#define TEXELS_EACH  ((TEXELS + THREADS - 1u) / THREADS)
// A thread's texels: of loops of constant length, that what it keeps of them is registers.
#define OWN_TEXELS(i, t) for (uint i = 0u, t = gl_LocalInvocationID.x; i < TEXELS_EACH; i++, t += THREADS) if (t < TEXELS)
#define SEES_NOTHING 0xffffffffu
// Slots but for 0, in rows of as many as the processor's loops take at once.
#define SLOTS ((BD_PROJECTED_MOST - 1u) / 64u * 64u)

shared uint map[BD_SIDE * BD_SIDE]; // keys; what is seen, then given, where neighbours look; rays
shared uint of_cluster[BD_CLUSTERS_MAX]; // bits of importance, shares, then points to the cluster's end
shared uint scanned[THREADS];
shared uint most_important, sum_of_shares;
shared vec4 sums[THREADS];

struct asking {
    vec3 position, across, along, up, normal;
    uint first_cluster, cluster_count, chance;
    float radius, off_plane;
};

asking read_asker()
{
    uint at = (args.first_asker + gl_WorkGroupID.x) * BD_POINT_ASKER_UVEC4S;
    uvec4 a = askers[at], b = askers[at + 1u], c = askers[at + 2u], d = askers[at + 3u], e = askers[at + 4u];
    return asking(uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz), uintBitsToFloat(c.xyz), uintBitsToFloat(d.xyz),
                  uintBitsToFloat(e.xyz), a.w, b.w, c.w, uintBitsToFloat(d.w), uintBitsToFloat(e.w));
}

// --- points of clusters -------------------------------------------------------------------------

// In the map's axes: the way to a point, and its normal.
void look(asking a, uint point, out vec3 to, out vec3 normal)
{
    uvec4 bits = points[point];
    to = in_axes(uintBitsToFloat(bits.xyz) - a.position, a.across, a.along, a.up);
    normal = in_axes(normal_of_bits(bits.w), a.across, a.along, a.up);
}

float importance_of(asking a, uint cluster)
{
    uvec4 of = clusters[a.first_cluster + cluster];
    point_steps steps = steps_of_cluster(of.x, of.y, of.z, of.w, args.explore, a.chance);
    float sum = 0.0;
    for (uint i = 0u, at = steps.at; i < steps.count; i++, at = next_place(steps, at)) {
        vec3 to, normal;
        look(a, steps.first + at, to, normal);
        float r2 = max(dot(to, to), NEAREST_R2), facing = dot(normal, to);
        if (is_point_seen(to.z, facing, r2)) sum += importance_of_point(to.z, abs(facing), r2, args.area * steps.part);
    }
    return sum;
}

void weigh_clusters(asking a)
{
    uint thread = gl_LocalInvocationID.x;
    if (thread == 0u) most_important = sum_of_shares = 0u;
    barrier();
    for (uint k = thread; k < a.cluster_count; k += THREADS) {
        of_cluster[k] = floatBitsToUint(args.is_uniform == 1u ? 1.0 : importance_of(a, k)); // in order, as none is below 0
        atomicMax(most_important, of_cluster[k]);
    }
    barrier();
    float most = uintBitsToFloat(most_important);
    for (uint k = thread; k < a.cluster_count; k += THREADS) {
        of_cluster[k] = share_of(uintBitsToFloat(of_cluster[k]), most);
        atomicAdd(sum_of_shares, of_cluster[k]);
    }
    barrier();
    uint alike = alike_of(sum_of_shares, a.cluster_count);
    for (uint k = thread; k < a.cluster_count; k += THREADS) of_cluster[k] = share_with_alike(of_cluster[k], alike);
    barrier();
}

// What threads before this one have.
uint sum_before(uint own)
{
    uint thread = gl_LocalInvocationID.x;
    scanned[thread] = own;
    barrier();
    for (uint reach = 1u; reach < THREADS; reach *= 2u) {
        uint before = thread >= reach ? scanned[thread - reach] : 0u;
        barrier();
        scanned[thread] += before;
        barrier();
    }
    return scanned[thread] - own;
}

// Of each cluster the sum to its end, instead of its own; a thread has some side by side.
void sum_clusters(uint count)
{
    uint thread = gl_LocalInvocationID.x, each = (count + THREADS - 1u) / THREADS;
    uint first = min(thread * each, count), end = min(first + each, count), sum = 0u;
    for (uint k = first; k < end; k++) sum += of_cluster[k];
    uint passed = sum_before(sum);
    for (uint k = first; k < end; k++) of_cluster[k] = passed += of_cluster[k];
    barrier();
}

// Instead of the sum of shares to a cluster's end, how many of its points are drawn.
void count_points(asking a)
{
    uint thread = gl_LocalInvocationID.x, last = a.cluster_count - 1u;
    uint each = (a.cluster_count + THREADS - 1u) / THREADS;
    uint first = min(thread * each, a.cluster_count), end = min(first + each, a.cluster_count);
    float step = float(args.exploit) / float(of_cluster[last]), start = part_of_one(stirred(chance_of_counts(a.chance)));
    uint passed = first > 0u ? of_cluster[first - 1u] : 0u;
    uint before = first > 0u ? drawn_before(passed, step, start, args.exploit) : 0u;
    barrier();
    for (uint k = first; k < end; k++) {
        uint beyond = k == last ? args.exploit : drawn_before(of_cluster[k], step, start, args.exploit);
        of_cluster[k] = min(args.explore + beyond - before, clusters[a.first_cluster + k].y);
        before = beyond;
    }
    barrier();
}

void take_all(asking a)
{
    for (uint k = gl_LocalInvocationID.x; k < a.cluster_count; k += THREADS)
        of_cluster[k] = clusters[a.first_cluster + k].y;
    barrier();
}

// --- what texels keep ---------------------------------------------------------------------------

// llvmpipe reads for invocations that are idle, too: whatever they hold, no index is wild.
uint drawn_until(uint cluster)
{
    return of_cluster[min(cluster, BD_CLUSTERS_MAX - 1u)];
}

// The first that ends behind it.
uint cluster_of(uint drawn, uint count)
{
    uint first = 0u, end = count - 1u;
    while (first < end) {
        uint middle = (first + end) / 2u;
        if (drawn_until(middle) > drawn) end = middle;
        else first = middle + 1u;
    }
    return first;
}

struct drawn_point {
    uint point;
    float area;
};

drawn_point point_of(asking a, uint drawn)
{
    uint k = cluster_of(drawn, a.cluster_count);
    uint before = k > 0u ? drawn_until(k - 1u) : 0u;
    uvec4 of = clusters[a.first_cluster + k];
    point_steps steps = steps_of_cluster(of.x, of.y, of.z, of.w, drawn_until(k) - before, a.chance);
    return drawn_point(steps.first + place_after(steps, drawn - before), args.area * steps.part);
}

void project(asking a, uint drawn, uint slot)
{
    drawn_point at = point_of(a, drawn);
    vec3 to, normal;
    look(a, at.point, to, normal);
    point_square square = square_of_point(to, normal, dot(normal, to), at.area, float(BD_SIDE), false,
                                          stirred_slot(slot), drawn_by_point(names[at.point], a.chance));
    if (square.key == NO_POINT) return;
    for (float v = square.first_v; v < square.end_v; v++)
        for (float u = square.first_u; u < square.end_u; u++) atomicMin(map[uint(v) * uint(BD_SIDE) + uint(u)], square.key);
}

// Twice its place in the order, and 1 if its back is seen.
uint seen_of(asking a, uint drawn)
{
    vec3 to, normal;
    uint point = point_of(a, drawn).point;
    look(a, point, to, normal);
    return 2u * point + uint(dot(normal, to) >= 0.0);
}

// A batch after the other, as slots are few: slot 0 is that of who was kept before.
void project_all(asking a, inout uint seen[TEXELS_EACH])
{
    uint thread = gl_LocalInvocationID.x, total = of_cluster[a.cluster_count - 1u];
    OWN_TEXELS(i, t) map[t] = NO_POINT;
    barrier();
    for (uint first = 0u; first < total; first += SLOTS) {
        uint end = min(first + SLOTS, total);
        for (uint drawn = first + thread; drawn < end; drawn += THREADS) project(a, drawn, drawn - first + 1u);
        barrier();
        OWN_TEXELS(i, t) {
            uint slot = map[t] & SLOT_MASK;
            if (map[t] == NO_POINT || slot == 0u) continue;
            seen[i] = seen_of(a, first + slot_of_stirred(slot) - 1u);
            map[t] &= ~SLOT_MASK;
        }
        barrier();
    }
}

// Of four beside a texel, those that are not empty, beyond the map's edge, too; `one` of them, if any.
uint count_beside(uint t, inout uint one)
{
    uint side = uint(BD_SIDE), u = t % side, v = t / side, count = 0u;
    uint beside[4] = uint[4](u > 0u ? t - 1u : t, u < side - 1u ? t + 1u : t, v > 0u ? t - side : t,
                             v < side - 1u ? t + side : t);
    for (uint k = 0u; k < 4u; k++) {
        uint other = beside[(k + t) % 4u];
        count += uint(other == t || map[other] != SEES_NOTHING);
        if (map[other] != SEES_NOTHING) one = map[other];
    }
    return count;
}

// An empty texel is a hole between points if at most one beside it is empty, too.
void fill_holes(inout uint seen[TEXELS_EACH])
{
    OWN_TEXELS(i, t) map[t] = seen[i];
    barrier();
    OWN_TEXELS(i, t) {
        uint one = SEES_NOTHING;
        if (seen[i] == SEES_NOTHING && count_beside(t, one) >= 3u) seen[i] = one;
    }
    barrier();
}

// --- light --------------------------------------------------------------------------------------

vec4 sum_of_all(vec4 own)
{
    uint thread = gl_LocalInvocationID.x;
    sums[thread] = own;
    barrier();
    for (uint half_count = THREADS / 2u; half_count > 0u; half_count /= 2u) {
        if (thread < half_count) sums[thread] += sums[thread + half_count];
        barrier();
    }
    vec4 sum = sums[0];
    barrier();
    return sum;
}

uint first_of_light()
{
    return (args.first_asker + gl_WorkGroupID.x) * (BD_POINT_LIGHT_UVEC4S + BD_MAP_RAY_SLOTS(args.rays));
}

float spread_of(asking a, uint seen, vec4 way_solid_angle, float light_of)
{
    vec3 to, normal;
    look(a, seen / 2u, to, normal);
    float r2 = max(dot(to, to), NEAREST_R2);
    return spread_of_texel(a.radius, a.off_plane, way_solid_angle.xyz, way_solid_angle.w, r2,
                           seen % 2u == 1u ? -normal : normal, light_of);
}

#ifdef BD_LOBES
vec3 read_vec3(uint at)
{
    return uintBitsToFloat(uvec3(lobes[at], lobes[at + 1u], lobes[at + 2u]));
}

// What a side sends by its lobe, if it has one.
vec3 sent_by_lobe(asking a, uint seen)
{
    uint at = lobes[seen];
    vec3 sum = vec3(0.0);
    if (at == BD_NO_LOBE) return sum;
    vec3 to_viewer = normalize(a.position - uintBitsToFloat(points[seen / 2u].xyz));
    vec3 color = read_vec3(at), normal = normal_of_bits(lobes[at + 6u]);
    float metallic = uintBitsToFloat(lobes[at + 3u]), roughness = uintBitsToFloat(lobes[at + 4u]);
    float f0_dielectric = uintBitsToFloat(lobes[at + 5u]);
    for (uint i = 0u, way = at + 8u; i < min(lobes[at + 7u], BD_POINT_LOBES); i++, way += BD_POINT_LOBE_UINTS)
        sum += read_vec3(way) * gltf_brdf(color, metallic, roughness, f0_dielectric, normal,
                                          normal_of_bits(lobes[way + 3u]), to_viewer);
    return sum;
}
#endif

// Leaves bits of what each gives in the map.
void sum_texels(asking a, uint seen[TEXELS_EACH])
{
    vec3 own = in_axes(a.normal, a.across, a.along, a.up);
    vec4 irradiance = vec4(0.0), directions = vec4(0.0), noise = vec4(0.0); // and the spread
    OWN_TEXELS(i, t) {
        map[t] = 0u;
        if (seen[i] == SEES_NOTHING) continue;
        vec3 of = vec3(radiance[3u * seen[i]], radiance[3u * seen[i] + 1u], radiance[3u * seen[i] + 2u]);
#ifdef BD_LOBES
        of += sent_by_lobe(a, seen[i]);
#endif
        vec3 weight = texels[BD_TEXEL_VEC4S * t].xyz;
        vec3 comes = of * max(dot(weight, own), 0.0);
        irradiance.rgb += comes;
        map[t] = floatBitsToUint(all_channels(comes));
        noise.rgb += half_of_texel(t % uint(BD_SIDE), t / uint(BD_SIDE)) == 0u ? comes : -comes;
        directions.xyz += weight * all_channels(of);
        if (a.radius > 0.0) irradiance.a += spread_of(a, seen[i], texels[BD_TEXEL_VEC4S * t + 1u], all_channels(of));
    }
    irradiance = sum_of_all(irradiance);
    directions = sum_of_all(directions);
    noise = sum_of_all(noise);
    vec3 world = from_axes(directions.xyz, a.across, a.along, a.up);
    uint at = first_of_light();
    if (gl_LocalInvocationID.x == 0u) {
        light[at] = floatBitsToUint(irradiance);
        light[at + 1u] = floatBitsToUint(vec4(irradiance_vector(irradiance.rgb, world, a.normal), 0.0));
        light[at + 2u] = floatBitsToUint(noise);
    }
}

// --- rays through texels ------------------------------------------------------------------------

// The most that a texel or one about it gives, of numbers that are none below 0: bits are in order.
float most_about(uint t)
{
    uint side = uint(BD_SIDE), u = t % side, v = t / side, most = 0u;
    for (uint y = max(v, 1u) - 1u; y <= min(v + 1u, side - 1u); y++)
        for (uint x = max(u, 1u) - 1u; x <= min(u + 1u, side - 1u); x++) most = max(most, map[y * side + x]);
    return uintBitsToFloat(most);
}

// How many a texel has in the mean, in `rays`, and has, in the map.
void draw_rays(asking a, out float rays[TEXELS_EACH])
{
    vec3 own = in_axes(a.normal, a.across, a.along, a.up);
    float about[TEXELS_EACH], size[TEXELS_EACH], first = first_of_map(a.chance);
    vec4 sums = vec4(0.0);
    OWN_TEXELS(i, t) {
        about[i] = most_about(t);
        size[i] = max(dot(texels[BD_TEXEL_VEC4S * t].xyz, own), 0.0);
        sums.xy += vec2(about[i], size[i]);
    }
    sums = sum_of_all(sums);
    OWN_TEXELS(i, t) {
        rays[i] = rays_of_texel(args.rays, size[i], sums.y, about[i], sums.x);
        map[t] = drawn_of_texel(rays[i], t % uint(BD_SIDE), t / uint(BD_SIDE), first);
    }
    barrier();
}

// Of each texel the sum to its end, instead of its own; a thread has some side by side.
void sum_drawn()
{
    uint first = min(gl_LocalInvocationID.x * TEXELS_EACH, TEXELS), end = min(first + TEXELS_EACH, TEXELS), sum = 0u;
    for (uint t = first; t < end; t++) sum += map[t];
    uint passed = sum_before(sum);
    for (uint t = first; t < end; t++) map[t] = passed += map[t];
    barrier();
}

void choose_rays(asking a, uint seen[TEXELS_EACH])
{
    float rays[TEXELS_EACH];
    draw_rays(a, rays);
    sum_drawn();
    uint at = first_of_light() + BD_POINT_LIGHT_UVEC4S, slots = BD_MAP_RAY_SLOTS(args.rays);
    OWN_TEXELS(i, t) {
        uint first = t > 0u ? map[t - 1u] : 0u, end = min(map[t], slots);
        for (uint k = first; k < end; k++) light[at + k] = uvec4(t, seen[i], floatBitsToUint(1.0 / rays[i]), k - first);
    }
    uint drawn = map[TEXELS - 1u];
    for (uint k = drawn + gl_LocalInvocationID.x; k < slots; k += THREADS) light[at + k] = uvec4(0u);
}

void main()
{
    asking a = read_asker();
    uint seen[TEXELS_EACH];
    for (uint i = 0u; i < TEXELS_EACH; i++) seen[i] = SEES_NOTHING;
    if (args.all == 1u) take_all(a);
    else {
        weigh_clusters(a);
        sum_clusters(a.cluster_count);
        count_points(a);
    }
    sum_clusters(a.cluster_count);
    project_all(a, seen);
    for (int round = 0; round < 2; round++) fill_holes(seen);
    sum_texels(a, seen);
    if (args.rays > 0u) choose_rays(a, seen);
}
