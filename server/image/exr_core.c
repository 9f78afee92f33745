#include "image/exr_core.h"

#include <stdio.h>

void bd_exr_keep_complaint(exr_const_context_t context, exr_result_t code, const char *message)
{
    (void)code;
    void *user = NULL;
    if (exr_get_user_data(context, &user) != EXR_ERR_SUCCESS || !user) return;
    struct bd_exr_complaint *complaint = user;
    if (complaint->message[0]) return;
    snprintf(complaint->message, sizeof complaint->message, "%s", message);
}

const char *bd_exr_why(const struct bd_exr_complaint *complaint, exr_result_t code)
{
    return complaint->message[0] ? complaint->message : exr_get_default_error_message(code);
}
