#include "confine/confine.h"

#include <sys/prctl.h>

#include "base/assert.h"

void bd_confine_privileges(void)
{
    // Every kernel since 3.5 has it, and nobody may be refused it.
    BD_ASSERT(prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0);
}
