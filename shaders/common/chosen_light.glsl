// What was chosen for an asker (common/asker.glsl) and is not hidden, summed.
layout(std430, binding = BD_STORAGE_OCCLUDED) readonly buffer occluded_block { uint occluded[]; };
layout(std430, binding = BD_STORAGE_PICKS) readonly buffer pick_block { vec4 picks[]; };

// At even and at odd places: each half of what all of them give.
struct halves {
    vec3 even, odd;
};

// `which` of a pick's vec4s (shared/choose.h).
halves halves_of(uint asker, uint which)
{
    halves sum = halves(vec3(0.0), vec3(0.0));
    for (uint i = 0u; i < args.rays_per_receiver; i++) {
        uint index = asker * args.rays_per_receiver + i;
        bool hidden = (occluded[index / 32u] >> index % 32u & 1u) != 0u;
        vec3 light = hidden ? vec3(0.0) : picks[index * BD_PICK_VEC4S + which].rgb;
        bool is_odd = (i & 1u) != 0u;
        sum.even += is_odd ? vec3(0.0) : light;
        sum.odd += is_odd ? light : vec3(0.0);
    }
    return sum;
}
