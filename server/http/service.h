/* What the handlers work with. Everything is borrowed and outlives the server. */
#ifndef HTTP_SERVICE_H
#define HTTP_SERVICE_H

#include "server/config.h"

struct access;
struct blobs;
struct grooms;
struct jobs;
struct store;
struct supervisor;
struct uploads;

struct service {
    const struct config *config;
    struct access *access;
    struct store *store;
    struct blobs *blobs;
    struct uploads *uploads;
    struct jobs *jobs;
    struct grooms *grooms;
    struct supervisor *supervisor;
    const char *worker_path;      /* groom-worker */
    const char *temporary_folder; /* for files without a name, on the disk of the data */
};

#endif
