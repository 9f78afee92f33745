// Parameters of techniques: KEY=VALUE text in, checked numbers out, and back into a report.
//
// One table holds every parameter that any technique takes, with range and default; a technique
// names the ones it reads. A key that no technique knows, one that this technique does not read,
// and a value out of range are refused by name.

#ifndef BD_TECHNIQUE_PARAMS_H
#define BD_TECHNIQUE_PARAMS_H

#include <stdint.h>

#include "base/err.h"

#define BD_PARAM_MAX       32
#define BD_PARAM_KEY_MAX   32
#define BD_PARAM_VALUE_MAX 48

// Unchecked text, as the client gave it. A repeated key: the last one wins.
struct bd_param_list {
    uint32_t count;
    struct {
        char key[BD_PARAM_KEY_MAX];
        char value[BD_PARAM_VALUE_MAX];
    } pairs[BD_PARAM_MAX];
};

// Splits "KEY=VALUE" and appends it.
BD_MUST_CHECK
enum bd_err bd_param_list_add(struct bd_param_list *list, const char *key_equals_value,
                              struct bd_fault *fault);

#endif
