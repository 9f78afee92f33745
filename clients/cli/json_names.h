// Names in a JSON document that the schema does not have.
//
// The converter passes over them, so that old readers take new documents. In a file that a person
// wrote, a misspelt name that is silently ignored costs more than an error. Thread: any.

#ifndef BD_CLI_JSON_NAMES_H
#define BD_CLI_JSON_NAMES_H

#include <jansson.h>
#include <protobuf-c/protobuf-c.h>

#include "base/err.h"

// BD_ERR_USAGE with the path ("ops[0].set_light.intensty") of the first one. What has the wrong
// type is left to the converter.
BD_MUST_CHECK
enum bd_err bd_cli_check_json_names(const json_t *json,
                                    const ProtobufCMessageDescriptor *descriptor,
                                    struct bd_fault *fault);

#endif
