// Irradiance that a frame's first sub-frame has, at the pixels of another: between the four of its
// pixels around where this one's ray passes, by those that see the same surface. Its pixels may be
// blocks of this one's.
//
// image 0: irradiance; a = 0 where too few of the four do, and the pixel has to be lit by itself.
// BD_ROUGH, image 1: what lobes of rough surfaces reflect, likewise.
// BD_NOISE, BD_NOISE_ROUGH, images 2 and 3: the noise of both, of its nearest pixel where it has to be lit.
// BD_VECTOR: the first sub-frame keeps what was gathered and the irradiance vector, and this pixel's
// own normal has its say. Without, only pixels whose shading normals all but agree share light.
#include "kernel/all_channels.h"
#include "common/one_surface.glsl"
#include "shared/shared_light.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_share_args args; };
layout(binding = 0, rgba32f) writeonly uniform image2D irradiance;
#ifdef BD_ROUGH
layout(binding = 1, rgba32f) writeonly uniform image2D rough;
layout(binding = BD_UNIT_FIRST_ROUGH) uniform sampler2D first_rough;
#endif
#ifdef BD_NOISE
layout(binding = 2, rgba32f) writeonly uniform image2D noise;
layout(binding = BD_UNIT_FIRST_NOISE) uniform sampler2D first_noise;
#endif
#ifdef BD_NOISE_ROUGH
layout(binding = 3, rgba32f) writeonly uniform image2D noise_rough;
layout(binding = BD_UNIT_FIRST_NOISE_ROUGH) uniform sampler2D first_noise_rough;
#endif
layout(binding = BD_UNIT_FIRST_DEPTH) uniform sampler2D first_depth;
layout(binding = BD_UNIT_FIRST_NORMALS) uniform usampler2D first_normals;
layout(binding = BD_UNIT_FIRST_MATERIAL) uniform sampler2D first_material;
layout(binding = BD_UNIT_FIRST_IRRADIANCE) uniform sampler2D first_irradiance;
#ifdef BD_VECTOR
layout(binding = BD_UNIT_FIRST_VECTOR) uniform sampler2D first_vector;
#endif

// Chord between two shading normals: irradiance changes by at most about this part of it.
const float SAME_NORMAL_CHORD = 0.1;
// Of the four's weights, those that see the same surface: from fewer light would be extrapolated.
// Indirect layer of `many_light`, 16 sub-frames and 32 rays: 4.7, 3.6, 3.2 and 3.0 % off with 0, .3,
// .6 and all, in Sponza 4.1, 4.0, 3.75 and 3.5 in 3.7, 3.7, 4.1 and 5.9 s.
const float LEAST_WEIGHT = 0.6;
// Of the most to the least that they have: where light differs so much from pixel to pixel something
// touches something, and what is between is not to be guessed: 2.79 -> 2.31 % in the Cornell box, whose
// lamp hangs a hundredth of a metre below the ceiling.
const float MOST_CONTRAST = 1.5;

// Where it is and which way it faces; the rest nobody asks for.
receiver first_receiver(ivec2 pixel)
{
    receiver r;
    uvec4 normals = texelFetch(first_normals, pixel, 0);
    vec2 at_px = (vec2(pixel) + args.first_sample_px.xy) * args.first_side_px + args.first_origin_px.xy;
    r.relative_position = view_relative_position_at(at_px, texelFetch(first_depth, pixel, 0).x);
    r.normal = unpack_precise_normal(normals.xy);
    r.normal_geometric = unpack_precise_normal(normals.zw);
    return r;
}

// A block's middle may be the pixel's own: between two such places there is no angle.
const float ONE_PLACE = 3e-5; // of the distance

bool is_one_place(receiver a, receiver b)
{
    vec3 across = b.relative_position - a.relative_position;
    return length(across) <= ONE_PLACE * length(a.relative_position);
}

bool shares_light(receiver here, ivec2 pixel)
{
    if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, textureSize(first_depth, 0)))) return false;
    if (!material_is_lit(texelFetch(first_material, pixel, 0))) return false;
    receiver there = first_receiver(pixel);
#ifndef BD_VECTOR
    if (distance(here.normal, there.normal) > SAME_NORMAL_CHORD) return false;
#endif
    return is_one_place(here, there) || is_one_surface(here, there);
}

struct shared_light {
    vec3 irradiance, vector, rough;
    vec4 noise, noise_rough;
    float weight, least, most; // of all channels together, of the pixels that it is made of
};

// Between pixels' places, which are whole numbers.
vec2 place_in_first(ivec2 pixel)
{
    vec2 from_origin_px = vec2(pixel) + view.sample_px.xy - args.first_origin_px.xy;
    return from_origin_px / args.first_side_px - args.first_sample_px.xy;
}

shared_light light_around(receiver here, ivec2 pixel)
{
    shared_light sum = shared_light(vec3(0.0), vec3(0.0), vec3(0.0), vec4(0.0), vec4(0.0), 0.0, 3.4e38, 0.0);
    vec2 at = place_in_first(pixel);
    ivec2 low = ivec2(floor(at));
    vec2 part = at - vec2(low);
    for (int i = 0; i < 4; i++) {
        ivec2 step = ivec2(i & 1, i >> 1);
        vec2 along = mix(1.0 - part, part, vec2(step));
        float weight = along.x * along.y;
        if (weight == 0.0 || !shares_light(here, low + step)) continue;
        vec3 irradiance_there = texelFetch(first_irradiance, low + step, 0).rgb;
        sum.irradiance += weight * irradiance_there;
        sum.least = min(sum.least, all_channels(irradiance_there));
        sum.most = max(sum.most, all_channels(irradiance_there));
#ifdef BD_ROUGH
        sum.rough += weight * texelFetch(first_rough, low + step, 0).rgb;
#endif
#ifdef BD_NOISE
        sum.noise += weight * texelFetch(first_noise, low + step, 0);
#endif
#ifdef BD_NOISE_ROUGH
        sum.noise_rough += weight * texelFetch(first_noise_rough, low + step, 0);
#endif
#ifdef BD_VECTOR
        sum.vector += weight * texelFetch(first_vector, low + step, 0).xyz;
#endif
        sum.weight += weight;
    }
    return sum;
}

bool may_be_taken_over(shared_light sum)
{
    return sum.weight > LEAST_WEIGHT && sum.most <= MOST_CONTRAST * sum.least;
}

vec3 at_normal(shared_light sum, vec3 normal)
{
    vec3 e = sum.irradiance / sum.weight;
#ifdef BD_VECTOR
    float of_fragments = all_channels(sum.irradiance);
    float of_pixel = max(dot(sum.vector, normal), 0.0);
    e *= of_fragments > 0.0 ? min(of_pixel / of_fragments, 4.0) : 0.0;
#endif
    return e;
}

void store_noise(ivec2 pixel, shared_light sum, bool is_taken_over)
{
    ivec2 nearest = clamp(ivec2(round(place_in_first(pixel))), ivec2(0), textureSize(first_depth, 0) - 1);
#ifdef BD_NOISE
    imageStore(noise, pixel, is_taken_over ? sum.noise / sum.weight : texelFetch(first_noise, nearest, 0));
#endif
#ifdef BD_NOISE_ROUGH
    imageStore(noise_rough, pixel, is_taken_over ? sum.noise_rough / sum.weight : texelFetch(first_noise_rough, nearest, 0));
#endif
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.first_row);
    if (pixel.x >= int(view.size_px.x) || gl_GlobalInvocationID.y >= args.row_count) return;
    receiver here = gbuffer_receiver(pixel);
    vec4 shared_value = vec4(0.0, 0.0, 0.0, here.lit ? 0.0 : 1.0), shared_rough = shared_value;
    if (here.lit) {
        shared_light sum = light_around(here, pixel);
        bool is_taken_over = may_be_taken_over(sum);
        store_noise(pixel, sum, is_taken_over);
        if (is_taken_over) {
            shared_value = vec4(at_normal(sum, here.normal), 1.0);
            shared_rough = vec4(sum.rough / sum.weight, 1.0);
        }
    }
    imageStore(irradiance, pixel, shared_value);
#ifdef BD_ROUGH
    imageStore(rough, pixel, shared_rough);
#endif
}
