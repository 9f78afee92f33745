// The JSON face: text to a message and back. The first byte chooses the message.

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "protocol/bounced.pb-c.h"
#include "protocol/json.h"

#include "target.h"

// What is written of a message reads as a message, and is written the same.
static void check_round_trip(const ProtobufCMessage *message)
{
    char *text = bd_json_text_from_message(message);
    BD_ASSERT(text);
    ProtobufCMessage *again = NULL;
    struct bd_err_detail detail = {0};
    enum bd_err err =
        bd_json_text_to_message(text, strlen(text), message->descriptor, &again, &detail);
    // Numbers that JSON cannot say are null, which reads as "not set".
    if (!err) {
        char *second = bd_json_text_from_message(again);
        BD_ASSERT(second);
        if (!strstr(text, "null")) BD_ASSERT(strcmp(text, second) == 0);
        free(second);
        protobuf_c_message_free_unpacked(again, NULL);
    } else {
        BD_ASSERT(strstr(text, "null"));
    }
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    static const ProtobufCMessageDescriptor *const descriptors[] = {
        &bounced__scene_add__descriptor,  &bounced__render__descriptor,
        &bounced__edit_batch__descriptor, &bounced__view_open__descriptor,
        &bounced__envelope__descriptor,
    };
    if (size == 0) return 0;
    const ProtobufCMessageDescriptor *descriptor =
        descriptors[bytes[0] % (sizeof descriptors / sizeof descriptors[0])];
    ProtobufCMessage *message = NULL;
    struct bd_err_detail detail = {0};
    enum bd_err err =
        bd_json_text_to_message((const char *)bytes + 1, size - 1, descriptor, &message, &detail);
    if (err) {
        BD_ASSERT(detail.message[0]);
        return 0;
    }
    check_round_trip(message);
    protobuf_c_message_free_unpacked(message, NULL);
    return 0;
}
