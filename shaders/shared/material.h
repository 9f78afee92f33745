// A material and the draw that uses it, as the raster passes read them.
#ifndef BD_SHARED_MATERIAL_H
#define BD_SHARED_MATERIAL_H

#include "shared/types.h"

struct bd_material_uniform {
    BD_VEC4 base_color;
    BD_VEC4 emissive; // xyz cd/m^2 in the frame's light unit

    BD_FLOAT metallic;
    BD_FLOAT roughness;
    BD_FLOAT normal_scale;
    BD_FLOAT f0_dielectric;

    BD_FLOAT alpha_cutoff;
    BD_UINT flags;          // BD_MATERIAL_*
    BD_UINT first_triangle; // of the draw
    BD_UINT triangles_per_instance;

    BD_UINT triangle_list; // where it begins (BD_TRIANGLE_LIST)
    BD_FLOAT transmission; // 0 where glass is opaque
    BD_UINT unused_1;
    BD_UINT unused_2;

    BD_VEC4 base_color_uv[2]; // rows of the texture transform; row 0's w = UV set
    BD_VEC4 metallic_roughness_uv[2];
    BD_VEC4 normal_uv[2];
    BD_VEC4 emissive_uv[2];
    BD_VEC4 transmission_uv[2];
};

#define BD_MATERIAL_DOUBLE_SIDED 1u
#define BD_MATERIAL_UNLIT        2u
#define BD_MATERIAL_MIRRORED     4u // the instance's transform mirrors: bitangents flip

#ifndef BD_GLSL
_Static_assert(sizeof(struct bd_material_uniform) == 240, "std140 size");
#endif

#endif
