#include "sched/fair_share.h"

#include <math.h>

void bd_fair_share_note(struct bd_fair_share *share, double ms, bool lower_waits, bool higher_waits)
{
    share->owed_ms += lower_waits && !higher_waits ? BD_SHARE_OF_TIME * ms : -ms;
    share->owed_ms = fmin(fmax(share->owed_ms, 0), BD_SHARE_OWED_MAX_MS);
}

bool bd_fair_share_begins_lower(const struct bd_fair_share *share)
{
    return share->owed_ms >= BD_SHARE_TURN_MS;
}

bool bd_fair_share_keeps_lower(const struct bd_fair_share *share)
{
    return share->owed_ms > 0;
}
