// Writes the receivers of a slice where loops over lanes read them (shared/receivers.h). Those
// that only fill the last group up are not lit. BD_CHOSEN: and where their rays start. BD_GLOSSY: and
// what specular lobes depend on, of pixels.
#include "common/asker_receiver.glsl"
#include "shared/receivers.h"
#ifdef BD_CHOSEN
#include "common/ray_start.glsl"
#include "common/systematic.glsl"
#endif

layout(local_size_x = 64) in;
layout(std430, binding = BD_STORAGE_RECEIVERS) writeonly buffer receiver_block { float receivers[]; };
#ifdef BD_CHOSEN
layout(std430, binding = BD_STORAGE_RAY_STARTS) writeonly buffer start_block { uint starts[]; };
layout(binding = BD_UNIT_GBUFFER_TRIANGLE) uniform usampler2D gbuffer_triangle;
#endif

#ifdef BD_GLOSSY
layout(std430, binding = BD_STORAGE_GLOSSY_RECEIVERS) writeonly buffer surface_block { float surfaces[]; };
#endif

void keep(uint index, uint field, float value)
{
    uint group = index / BD_LANES;
    receivers[(group * BD_RECEIVER_FIELDS + field) * BD_LANES + index % BD_LANES] = value;
}

void keep(uint index, uint field, vec3 value)
{
    for (uint c = 0u; c < 3u; c++) keep(index, field + c, value[c]);
}

#ifdef BD_CHOSEN
void keep_word(uint index, uint field, uint value)
{
    uint group = index / BD_LANES;
    starts[(group * BD_START_FIELDS + field) * BD_LANES + index % BD_LANES] = value;
}

void keep_start(uint index, asker_place asker, ivec2 pixel)
{
    receiver at = ray_receiver(pixel);
    for (uint c = 0u; c < 3u; c++) {
        keep_word(index, BD_START_POSITION + c, floatBitsToUint(at.position[c]));
        keep_word(index, BD_START_NORMAL_GEOMETRIC + c, floatBitsToUint(at.normal_geometric[c]));
    }
    keep_word(index, BD_START_TRIANGLE, texelFetch(gbuffer_triangle, pixel, 0).x - 1u);
    keep_word(index, BD_START_PLACE, floatBitsToUint(place_in_part(uvec2(asker.block))));
}
#endif

#ifdef BD_GLOSSY
void keep_of_surface(uint index, uint field, float value)
{
    uint group = index / BD_LANES;
    surfaces[(group * BD_GLOSSY_FIELDS + field) * BD_LANES + index % BD_LANES] = value;
}

void keep_surface(uint index, receiver r)
{
    vec3 viewer = direction_to_viewer(r.relative_position);
    for (uint c = 0u; c < 3u; c++) {
        keep_of_surface(index, BD_GLOSSY_VIEWER + c, viewer[c]);
        keep_of_surface(index, BD_GLOSSY_BASE_COLOR + c, r.base_color[c]);
    }
    keep_of_surface(index, BD_GLOSSY_METALLIC, r.metallic);
    keep_of_surface(index, BD_GLOSSY_ROUGHNESS, r.roughness);
    keep_of_surface(index, BD_GLOSSY_F0_DIELECTRIC, r.f0_dielectric);
    bool has_lobe = has_glossy_lobe(r.metallic, r.roughness);
    keep_of_surface(index, BD_GLOSSY_HAS_LOBE, has_lobe ? 1.0 : 0.0);
}
#endif

void main()
{
    uint index = gl_GlobalInvocationID.x;
    asker_place asker = asker_place_at(uvec2(index % args.tile_width, index / args.tile_width));
    keep(index, BD_RECEIVER_LIT, 0.0);
    if (!asker.exists) return;
    ivec2 pixel;
    receiver r = asker_receiver(asker, pixel);
    keep(index, BD_RECEIVER_LIT, r.lit ? 1.0 : 0.0);
    keep(index, BD_RECEIVER_POSITION, r.position);
    keep(index, BD_RECEIVER_NORMAL, r.normal);
    keep(index, BD_RECEIVER_NORMAL_GEOMETRIC, r.normal_geometric);
#ifdef BD_SPREAD
    light_spread spread = spread_of_block(asker.level, r, args.finest_level);
    keep(index, BD_RECEIVER_RADIUS, spread.radius);
    keep(index, BD_RECEIVER_OFF_PLANE, spread.off_plane);
#endif
#ifdef BD_CHOSEN
    keep_start(index, asker, pixel);
#endif
#ifdef BD_GLOSSY
    keep_surface(index, r);
#endif
}
