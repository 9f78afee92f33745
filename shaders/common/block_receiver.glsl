// The receiver that stands for a block of pixels.
#include "common/blocks.glsl"
#include "common/vpl_gather.glsl"

layout(binding = BD_UNIT_BLOCK_REPRESENTATIVE) uniform usampler2D representative;

// Four pixels are one surface if their normals agree to about 25 degrees and their depths to this.
const float ONE_SURFACE_COSINE = 0.9;
const float ONE_SURFACE_DEPTH = 0.05;

float depth_of(receiver r) { return -dot(view.axis_z.xyz, r.relative_position); }

bool is_one_surface(receiver four[4], vec3 mean_normal)
{
    float nearest = depth_of(four[0]), farthest = nearest;
    bool lit = true;
    for (int i = 0; i < 4; i++) {
        nearest = min(nearest, depth_of(four[i]));
        farthest = max(farthest, depth_of(four[i]));
        lit = lit && four[i].lit;
    }
    return lit && farthest - nearest <= ONE_SURFACE_DEPTH * abs(nearest) &&
           dot(mean_normal, mean_normal) >= ONE_SURFACE_COSINE * ONE_SURFACE_COSINE;
}

receiver representative_receiver(uint level, ivec2 block)
{
    uint pixel = texelFetch(representative, in_stack(level, block), 0).x;
    return gbuffer_receiver(ivec2(BD_PIXEL_X(pixel), BD_PIXEL_Y(pixel)));
}

// The mean of the pixels around the block's centre, so that the sample lies there and not half a
// pixel beside it; where they are not one surface, the pixel that stands for the block.
receiver block_receiver(uint level, ivec2 block)
{
    ivec4 pixels = pixels_of_block(level, block);
    ivec2 low = (pixels.xy + pixels.zw) >> 1, high = (pixels.xy + pixels.zw + 1) >> 1;
    receiver r = gbuffer_receiver(low);
    if (level == 0u) return r;
    receiver four[4] = receiver[4](r, gbuffer_receiver(ivec2(high.x, low.y)),
                                   gbuffer_receiver(ivec2(low.x, high.y)), gbuffer_receiver(high));
    vec3 position = vec3(0.0), normal = vec3(0.0), geometric = vec3(0.0);
    for (int i = 0; i < 4; i++) {
        position += 0.25 * four[i].relative_position;
        normal += 0.25 * four[i].normal;
        geometric += 0.25 * four[i].normal_geometric;
    }
    if (!is_one_surface(four, normal) || !(dot(geometric, geometric) > 0.0))
        return representative_receiver(level, block);
    r.relative_position = position;
    r.position = view.position.xyz + position;
    r.normal = normalize(normal);
    r.normal_geometric = normalize(geometric);
    return r;
}
