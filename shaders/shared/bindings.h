// Binding numbers, one truth for C and GLSL. Textures and arrays share one number space (both
// are texture units on software devices); images, storage blocks and uniform blocks have one
// each.
#ifndef BD_SHARED_BINDINGS_H
#define BD_SHARED_BINDINGS_H

// Uniform blocks.
#define BD_UNIFORM_VIEW     0 // shared/view.h: the camera or light face that is rendered for
#define BD_UNIFORM_ARGS     1 // the arguments of the pass
#define BD_UNIFORM_MATERIAL 2 // shared/material.h, raster passes
#define BD_UNIFORM_LIGHT    3 // shared/light.h
#define BD_UNIFORM_MULTIRES 2 // shared/multires.h, passes over blocks
#define BD_UNIFORM_TREE     3 // shared/gather_tree.h, passes that walk trees

// Textures and arrays of the raster passes (gbuffer, shadow_map, rsm).
#define BD_UNIT_INSTANCES          0 // array, shared/instance.h
#define BD_UNIT_BASE_COLOR         1
#define BD_UNIT_METALLIC_ROUGHNESS 2
#define BD_UNIT_NORMAL             3
#define BD_UNIT_EMISSIVE           4
#define BD_UNIT_SURFACE_TRIANGLES  5 // array, three vec4s a triangle: corner, edge, edge
#define BD_UNIT_TRIANGLE_LIST      6 // array, four triangles of an instance a vec4
#define BD_UNIT_TRANSMISSION       7

// Textures and arrays of everything that reads the G-buffer.
#define BD_UNIT_GBUFFER_DEPTH    0
#define BD_UNIT_GBUFFER_NORMALS  1
#define BD_UNIT_GBUFFER_ALBEDO   2
#define BD_UNIT_GBUFFER_MATERIAL 3
#define BD_UNIT_GBUFFER_TRIANGLE 4
#define BD_UNIT_GBUFFER_EMISSION 5
#define BD_UNIT_TREE_NODES       8 // array, shared/vpl_tree.h
#define BD_UNIT_TRIANGLES        6 // array, three vec4s a triangle
#define BD_UNIT_SHADOW_IDS       7
#define BD_UNIT_VPLS             6 // array, shared/vpl.h
#define BD_UNIT_VPL_QUADS        7 // array, shared/vpl.h
#define BD_UNIT_VPL_GROUPS       10 // array, shared/vpl.h
#define BD_UNIT_DIRECT           6
#define BD_UNIT_INDIRECT         7
#define BD_UNIT_INDIRECT_GLOSSY  8
#define BD_UNIT_AREA_LIGHT       9
#define BD_UNIT_INDIRECT_ROUGH   10
#define BD_UNIT_GLASS            11
// Those of composite, beside what they are of.
#define BD_UNIT_AREA_DOUBT     4
#define BD_UNIT_INDIRECT_DOUBT 12
#define BD_UNIT_GLOSSY_DOUBT   13
#define BD_UNIT_ROUGH_DOUBT    14
#define BD_UNIT_GLASS_DOUBT    15

// Textures of what works on blocks of pixels (shared/multires.h), beside the G-buffer and VPLs.
#define BD_UNIT_BLOCK_FLAGS          8
#define BD_UNIT_BLOCK_REPRESENTATIVE 9
#define BD_UNIT_FINE                 10
#define BD_UNIT_FINE_VECTOR          11
#define BD_UNIT_BLOCK_SURFACES       12
#define BD_UNIT_BLOCK_PAIRS          13

// Textures of subsplats, beside the G-buffer and VPLs.
#define BD_UNIT_ALL_IRRADIANCE 10

// Of the first sub-frame, in share, beside this one's G-buffer; and in fragments, of pixels alone.
#define BD_UNIT_FIRST_DEPTH      4
#define BD_UNIT_FIRST_NORMALS    5
#define BD_UNIT_FIRST_MATERIAL   6
#define BD_UNIT_FIRST_IRRADIANCE 7
#define BD_UNIT_FIRST_VECTOR     8
#define BD_UNIT_FIRST_ROUGH      9
#define BD_UNIT_LIT              10
#define BD_UNIT_FIRST_NOISE       11
#define BD_UNIT_FIRST_NOISE_ROUGH 12

// Of what few rays left, in filter_fragments, beside the G-buffer.
#define BD_UNIT_NOISY_LIGHT  4
#define BD_UNIT_NOISY_VECTOR 5
#define BD_UNIT_NOISE        6

// Of what the camera sees, as senders, in residual: arrays and storage blocks.
#define BD_UNIT_SCREEN_PARTS     0
#define BD_UNIT_SCREEN_PATCHES   1
#define BD_UNIT_SCREEN_RECEIVERS 2
#define BD_UNIT_SCREEN_SURFACES  3
#define BD_STORAGE_SCREEN_BOUNDS 0
#define BD_STORAGE_SCREEN_LIGHT  1
#define BD_STORAGE_SCREEN_LOBES  2

// Images of glossy_blocks.
#define BD_IMAGE_GLOSSY_FLAGS  0
#define BD_IMAGE_SURFACE_LEAST 1
#define BD_IMAGE_SURFACE_MOST  2

// Images of subsplats.
#define BD_IMAGE_GLOSSY_FINE    0
#define BD_IMAGE_GLOSSY_COARSE  1
#define BD_IMAGE_GLOSSY_SLOPE_X 2
#define BD_IMAGE_GLOSSY_SLOPE_Y 3
#define BD_IMAGE_GLOSSY         4

// Storage blocks of choose and of who gathers what it chose, beside those of gather_tree.
#define BD_STORAGE_SEGMENTS 3
#define BD_STORAGE_OCCLUDED 4
#define BD_STORAGE_PREFIX   5
#define BD_STORAGE_PICKS    6

// Storage blocks of visibility, beside BD_STORAGE_SEGMENTS and BD_STORAGE_OCCLUDED, or the first two.
#define BD_STORAGE_RAYS          3
#define BD_STORAGE_RAY_HITS      4
#define BD_STORAGE_RAY_NODES     0
#define BD_STORAGE_RAY_TRIANGLES 1
#define BD_STORAGE_RAY_PLACES    2
#define BD_STORAGE_RAY_COUNTS    5
#define BD_STORAGE_RAY_CUTOUTS   6
#define BD_STORAGE_RAY_TEXELS    7

// Storage blocks of imperfect_shadows, and of who asks those beside BD_STORAGE_SEGMENTS and
// BD_STORAGE_OCCLUDED.
#define BD_STORAGE_SHADOW_POINTS  0
#define BD_STORAGE_SHADOW_CENTRES 1
#define BD_STORAGE_SHADOW_TEXELS  2

// Storage blocks of point_gather.
#define BD_STORAGE_POINTS         0
#define BD_STORAGE_POINT_RADIANCE 1
#define BD_STORAGE_POINT_TEXELS   2
#define BD_STORAGE_POINT_CLUSTERS 3
#define BD_STORAGE_POINT_ASKERS   4
#define BD_STORAGE_POINT_LIGHT    5
#define BD_STORAGE_POINT_NAMES    6
#define BD_STORAGE_POINT_LOBES    7

// Storage blocks of receivers, beside BD_STORAGE_FRAGMENTS.
#define BD_STORAGE_RECEIVERS        3
#define BD_STORAGE_RECEIVER_LIGHT   4
#define BD_STORAGE_RAY_STARTS       5
#define BD_STORAGE_GLOSSY_RECEIVERS 6
#define BD_STORAGE_GLOSSY_LIGHT     5

// Storage blocks of gather_fragments.
#define BD_STORAGE_FRAGMENTS 0

// Textures of vpl_grid.
#define BD_UNIT_RSM_POSITION 0
#define BD_UNIT_RSM_NORMAL   1
#define BD_UNIT_RSM_ALBEDO   2
#define BD_UNIT_RSM_WEIGHT   3

// Textures of discontinuity, beside those of the G-buffer or the light's map.
#define BD_UNIT_FINER_DEPTH        5
#define BD_UNIT_FINER_NORMAL       6
#define BD_UNIT_FINER_NORMAL_LEAST 7
#define BD_UNIT_OWN_TESTS          9

// Images of discontinuity.
#define BD_IMAGE_DEPTH_MEASURES        0
#define BD_IMAGE_NORMAL_MEASURES       1
#define BD_IMAGE_NORMAL_LEAST_MEASURES 2
#define BD_IMAGE_WORDS                 3
#define BD_IMAGE_REPRESENTATIVES       4

// Storage blocks of vpl_grid.
#define BD_STORAGE_VPLS      0
#define BD_STORAGE_VPL_QUADS 1

// Storage blocks of vpl_tree and gather_tree.
#define BD_STORAGE_TREE_NODES 0
#define BD_STORAGE_ESTIMATES  1 // beside BD_STORAGE_FRAGMENTS
#define BD_STORAGE_NEXT_ROOTS 2

// Storage blocks of surfaces, and of upsample beside BD_STORAGE_FRAGMENTS.
#define BD_STORAGE_OUTER_BLOCKS   1
#define BD_STORAGE_OUTER_CHILDREN 2
#define BD_STORAGE_SURFACE_COUNTS 3
#define BD_STORAGE_LOOK_BLOCKS    4

// Storage blocks of fragments.
#define BD_STORAGE_FRAGMENT_MASKS    0
#define BD_STORAGE_REACHED_MASKS     1
#define BD_STORAGE_FRAGMENT_SCAN     2
#define BD_STORAGE_FRAGMENT_SUMMARY  3
#define BD_STORAGE_FRAGMENT_DISPATCH 4
#define BD_STORAGE_FRAGMENT_LIST     5
#define BD_STORAGE_FIRST_MASKS       6
#define BD_STORAGE_FRAGMENT_PARENTS  1
#define BD_STORAGE_BLOCK_MASKS       3

// Storage blocks of subsplats.
#define BD_STORAGE_SUBSPLATS       0
#define BD_STORAGE_SUBSPLAT_MASKS  1
#define BD_STORAGE_SPLIT_MASKS     2
#define BD_STORAGE_SUBSPLAT_SCAN   3
#define BD_STORAGE_SUBSPLAT_COUNTS 4
#define BD_STORAGE_NEXT_SUBSPLATS  5
#define BD_STORAGE_NEXT_MASKS      6

#endif
