// Light at children of parents in the middle of one surface, from one level to the next finer one: the
// weights are always the same there, and little is to be read. Nothing at the other children of level 0,
// which outer.comp and own.comp know more of.
#include "pass/upsample/light.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

light around(ivec2 parent, int x, int y) { return stacked_light(args.above, parent + ivec2(x, y)); }

// The same as outer.comp's with all neighbours: `x`, `y`, `xy` are beside the child, the others opposite.
light inner_child(light home, light x, light y, light xy, light x_before, light y_before)
{
    light l;
    l.irradiance = (9.0 * home.irradiance + 3.0 * (x.irradiance + y.irradiance) + xy.irradiance) / 16.0;
    l.vector = (9.0 * home.vector + 3.0 * (x.vector + y.vector) + xy.vector) / 16.0;
    l.state = INTERPOLATED;
    bend(l, x_before, home, x);
    bend(l, y_before, home, y);
    vec3 least = min(min(home.irradiance, x.irradiance), min(y.irradiance, xy.irradiance));
    vec3 most = max(max(home.irradiance, x.irradiance), max(y.irradiance, xy.irradiance));
    vec3 slack = 0.25 * (most - least);
    l.irradiance = clamp(l.irradiance, max(least - slack, vec3(0.0)), most + slack);
    return l;
}

// A part of a block that light changes too much over (pass/fragments.h) keeps its own.
void store_unlit(ivec2 child, light l)
{
    if (!is_fragment(child)) store(child, l);
}

void make_children(ivec2 parent)
{
    light home = around(parent, 0, 0);
    light n = around(parent, 0, -1), e = around(parent, 1, 0), s = around(parent, 0, 1), w = around(parent, -1, 0);
    ivec2 child = 2 * parent;
    store_unlit(child, inner_child(home, w, n, around(parent, -1, -1), e, s));
    store_unlit(child + ivec2(1, 0), inner_child(home, e, n, around(parent, 1, -1), w, s));
    store_unlit(child + ivec2(0, 1), inner_child(home, w, s, around(parent, -1, 1), e, n));
    store_unlit(child + ivec2(1, 1), inner_child(home, e, s, around(parent, 1, 1), w, n));
}

void clear_children(ivec2 parent)
{
#ifdef BD_FINE
    for (int i = 0; i < 4; i++) imageStore(irradiance, 2 * parent + ivec2(i & 1, i >> 1), vec4(0.0));
#endif
}

void main()
{
    ivec2 parent = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, args.first_row);
    if (gl_GlobalInvocationID.y >= args.row_count || !multires_has(args.level, 2u * uvec2(parent))) return;
    if (is_inner(args.above, parent))
        make_children(parent);
    else
        clear_children(parent);
}
