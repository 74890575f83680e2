#include "proto/job.h"

#include <string.h>

static const char *const names[JOB_STATE_COUNT] = {
#define JOB_STATE_NAME(constant, name, is_end) name,
    JOB_STATE_LIST(JOB_STATE_NAME)
#undef JOB_STATE_NAME
};

static const char is_end_state[JOB_STATE_COUNT] = {
#define JOB_STATE_END(constant, name, is_end) is_end,
    JOB_STATE_LIST(JOB_STATE_END)
#undef JOB_STATE_END
};

const char *job_state_name(job_state state)
{
    return (unsigned)state < JOB_STATE_COUNT ? names[state] : "unknown";
}

job_state job_state_parse(const char *name)
{
    for (int s = 0; name && s < JOB_STATE_COUNT; s++)
        if (!strcmp(names[s], name)) return (job_state)s;
    return JOB_STATE_COUNT;
}

int job_state_is_end(job_state state)
{
    return (unsigned)state < JOB_STATE_COUNT && is_end_state[state];
}
