// The kinds of operations that an edit has.

#include "scene/edit/edit_kinds.h"

const struct bd_edit_kind_row bd_edit_kinds[BD_EDIT_KIND_COUNT] = {
#define X(name, wire, object, does, help) {#wire, BD_OBJECT_##object, BD_EDIT_##does, help},
    BD_EDIT_MAP(X)
#undef X
};
