/* What an attempt of a job will need, from the size of its strands: what a cluster is asked for. */
#ifndef JOBS_SIZE_H
#define JOBS_SIZE_H

#include "server/jobs/jobs.h"
#include "server/launch/launch.h"

/* Generous rather than close: an attempt that gets too little is ended by the cluster. Of a job that
 * cannot be read, what the smallest one needs. */
struct launch_size size_of_job(struct jobs *jobs, const char *job_id);
/* The same from the number of vertices and the quality ("draft", "standard", "high"). */
struct launch_size size_of_fit(uint64_t n_vertices, const char *quality);

#endif
