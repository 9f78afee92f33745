// Fields of an operation as tests write them down: FIELDS(TEXT(name, "a"), NUMBERS(range, 7)). They
// live as long as the block.

#ifndef BD_TESTS_UNIT_SCENE_FIELDS_H
#define BD_TESTS_UNIT_SCENE_FIELDS_H

#include "scene/edit/edit.h"

#define FIELDS(...)                                                                                \
    .fields = (const struct bd_field_value[]){__VA_ARGS__},                                        \
    .field_count =                                                                                 \
        sizeof((const struct bd_field_value[]){__VA_ARGS__}) / sizeof(struct bd_field_value)
#define NUMBERS(name_, ...)                                                                        \
    {                                                                                              \
        .name = #name_, .numbers = (const double[]){__VA_ARGS__},                                  \
        .count = sizeof((const double[]){__VA_ARGS__}) / sizeof(double)                            \
    }
#define WHOLE(name_, value)                                                                        \
    {                                                                                              \
        .name = #name_, .whole = (value)                                                           \
    }
#define TEXT(name_, value)                                                                         \
    {                                                                                              \
        .name = #name_, .text = (value)                                                            \
    }

#endif
