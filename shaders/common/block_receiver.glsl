// The receiver that stands for a block of pixels.
#include "common/blocks.glsl"
#include "common/one_surface.glsl"
#include "common/vpl_gather.glsl"

layout(binding = BD_UNIT_BLOCK_REPRESENTATIVE) uniform usampler2D representative;

ivec2 representative_pixel(uint level, ivec2 block)
{
    uint pixel = texelFetch(representative, in_stack(level, block), 0).x;
    return ivec2(BD_PIXEL_X(pixel), BD_PIXEL_Y(pixel));
}

// The mean of the pixels around the block's centre, so that the sample lies there and not half a
// pixel beside it; where they are not one surface, the pixel that stands for the block. On curved
// surfaces and over creases the mean lies beneath the surface, where the surface's own VPLs would
// light it: so only the part of the way to it along one pixel's plane counts, and that pixel's
// geometric normal. `pixel` = that one.
receiver centre_receiver(uint level, ivec2 block, out ivec2 pixel)
{
    ivec4 pixels = pixels_of_block(level, block);
    ivec2 low = (pixels.xy + pixels.zw) >> 1, high = (pixels.xy + pixels.zw + 1) >> 1;
    receiver r = gbuffer_receiver(low);
    pixel = low;
    receiver four[4] = receiver[4](r, gbuffer_receiver(ivec2(high.x, low.y)),
                                   gbuffer_receiver(ivec2(low.x, high.y)), gbuffer_receiver(high));
    vec3 to_centre = vec3(0.0), normal = vec3(0.0);
    bool whole = true;
    for (int i = 0; i < 4; i++) {
        to_centre += 0.25 * (four[i].relative_position - r.relative_position);
        normal += 0.25 * four[i].normal;
        whole = whole && four[i].lit && is_one_surface(r, four[i]);
    }
    if (!whole) {
        pixel = representative_pixel(level, block);
        return gbuffer_receiver(pixel);
    }
    vec3 along = to_centre - r.normal_geometric * dot(to_centre, r.normal_geometric);
    r.relative_position += along;
    r.position = view.position.xyz + r.relative_position;
    r.normal = normalize(normal);
    return r;
}

#ifdef BD_SPREAD
// A surface that is seen more aslant than this is not taken for longer.
const float LONGEST_COSINE = 0.2;

// Of nothing yet. Blocks of the finest level and below may hold several surfaces.
light_spread spread_of_block(uint level, receiver r, uint finest_level)
{
    float depth = view_is_orthographic() ? 1.0 : -dot(view.axis_z.xyz, r.relative_position);
    float half_pixel = view.axis_x.w / float(view.size_px.x) * depth;
    float cosine = abs(dot(direction_to_viewer(r.relative_position), r.normal_geometric));
    float radius = half_pixel * exp2(float(level)) / max(cosine, LONGEST_COSINE);
    // Nobody splits pixels.
    return level == 0u ? light_spread(0.0, 0.0, 0.0)
                       : light_spread(0.0, radius, level <= finest_level ? 1.0 : 0.0);
}
#endif

// `pixel`: one that lies on the block's surface, near where the receiver is.
receiver block_receiver(uint level, ivec2 block, out ivec2 pixel)
{
    pixel = block;
    if (level == 0u) return gbuffer_receiver(block);
    receiver r = centre_receiver(level, block, pixel);
#ifdef BD_VECTOR
    // Each pixel's own shading normal has its say later; here one would speak for all.
    r.normal = r.normal_geometric;
#endif
    return r;
}

receiver block_receiver(uint level, ivec2 block)
{
    ivec2 pixel;
    return block_receiver(level, block, pixel);
}
