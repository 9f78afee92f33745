#include "image/exr_core.h"

#include <stdio.h>

static _Thread_local struct bd_exr_complaint *listening;

void bd_exr_listen(struct bd_exr_complaint *complaint)
{
    listening = complaint;
}

void bd_exr_keep_complaint(exr_const_context_t context, exr_result_t code, const char *message)
{
    (void)context, (void)code;
    if (!listening || listening->message[0]) return;
    snprintf(listening->message, sizeof listening->message, "%s", message);
}

const char *bd_exr_why(const struct bd_exr_complaint *complaint, exr_result_t code)
{
    return complaint->message[0] ? complaint->message : exr_get_default_error_message(code);
}
