/* sample: a reconstruction with known truth, made here, without a server. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "client/groomctl/api.h"
#include "client/groomctl/output_file.h"
#include "groom/document.h"
#include "groom/format.h"
#include "groom/mesh.h"
#include "groom/sample.h"

static int complain(groom_status status, const struct groom_diag *diag)
{
    fprintf(stderr, "groomctl: %s: %s\n", groom_status_message(status),
            diag->status == status ? diag->detail : "");
    return status == GROOM_EINVAL ? WRONG_USAGE : REFUSED;
}

/* --- options -------------------------------------------------------------------------------- */

static int whole_number(const struct arguments *arguments, const char *name, uint64_t maximum,
                        uint64_t *value)
{
    const char *text = argument(arguments, name);
    char *end;
    if (!text)
        return 1;
    errno = 0;
    unsigned long long number = strtoull(text, &end, 10);
    if (errno || end == text || *end || text[0] == '-' || number > maximum) {
        groomctl_usage_error("sample", "--%s is \"%s\"; it must be a whole number up to %llu", name, text,
                             (unsigned long long)maximum);
        return 0;
    }
    *value = number;
    return 1;
}

static int count(const struct arguments *arguments, const char *name, uint32_t *value)
{
    uint64_t number = *value;
    int ok = whole_number(arguments, name, UINT32_MAX, &number);
    *value = (uint32_t)number;
    return ok;
}

/* Fewer strands than the style's own guides ask for fewer guides. */
static void fit_counts(const struct arguments *arguments, struct groom_sample_options *options)
{
    if (!argument(arguments, "guides") && options->n_guides > options->n_strands)
        options->n_guides = options->n_strands;
    if (options->n_operator_guides > options->n_guides)
        options->n_operator_guides = options->n_guides;
}

static int read_options(const struct arguments *arguments, struct groom_sample_options *options)
{
    const char *name = argument(arguments, "style");
    groom_sample_style style = GROOM_SAMPLE_CURLY;
    struct groom_diag diag;
    if (name && groom_sample_style_parse(name, &style, &diag) != GROOM_OK)
        return groomctl_usage_error("sample", "%s", diag.detail);
    if (argument(arguments, "clean"))
        groom_sample_options_init(style, options);
    else
        groom_sample_options_capture(style, options);
    if (!count(arguments, "strands", &options->n_strands) ||
        !count(arguments, "vertices", &options->n_vertices) ||
        !count(arguments, "guides", &options->n_guides) ||
        !whole_number(arguments, "seed", UINT64_MAX, &options->seed))
        return WRONG_USAGE;
    fit_counts(arguments, options);
    return DONE;
}

/* --- files ------------------------------------------------------------------------------------ */

static int path_of(const char *folder, const char *name, char *path, size_t size)
{
    return (size_t)snprintf(path, size, "%s/%s", folder, name) < size;
}

static int finish_file(struct output_file *file, groom_status status, const struct groom_diag *diag)
{
    if (status == GROOM_OK)
        return output_file_commit(file) ? DONE : REFUSED;
    if (file->failure[0])
        fprintf(stderr, "groomctl: %s cannot be written: %s\n", file->path, file->failure);
    else
        complain(status, diag);
    output_file_abort(file);
    return REFUSED;
}

static int write_strands(const struct groom_sample *sample, const char *path)
{
    struct output_file file;
    struct groom_diag diag = {0};
    struct groom_write_options options = {.format = GROOM_FORMAT_HAIR, .frame = {.unit_m = 1}};
    if (!output_file_open(&file, path))
        return REFUSED;
    groom_status st = groom_strands_write(sample->capture, &options, output_file_sink(&file), NULL, &diag);
    return finish_file(&file, st, &diag);
}

static int write_head(const struct groom_sample *sample, const char *path)
{
    struct output_file file;
    struct groom_diag diag = {0};
    if (!output_file_open(&file, path))
        return REFUSED;
    groom_status st =
        groom_mesh_write_obj(sample->head, (struct groom_frame){.unit_m = 1}, output_file_sink(&file), &diag);
    return finish_file(&file, st, &diag);
}

static int write_truth(const struct groom_sample *sample, const char *path)
{
    struct groom_diag diag = {0};
    char *json = NULL;
    size_t n = 0;
    groom_status st = groom_document_write(sample->truth, NULL, NULL, &json, &n, &diag);
    int status = st != GROOM_OK ? complain(st, &diag) : output_file_save(path, json, n) ? DONE : REFUSED;
    free(json);
    return status;
}

static int write_cameras(const struct groom_sample *sample, const char *path)
{
    struct groom_diag diag = {0};
    char *json = NULL;
    groom_status st = groom_sample_cameras_print(sample, &json, &diag);
    int status = st != GROOM_OK                               ? complain(st, &diag)
                 : output_file_save(path, json, strlen(json)) ? DONE
                                                              : REFUSED;
    free(json);
    return status;
}

static const struct {
    const char *name;
    int (*write)(const struct groom_sample *sample, const char *path);
} files[] = {{"strands.hair", write_strands},
             {"head.obj", write_head},
             {"truth.groom.json", write_truth},
             {"cameras.json", write_cameras}};

static int print_summary(const struct groomctl *ctl, const struct groom_sample *sample, const char *folder)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "folder", folder);
    cJSON_AddNumberToObject(object, "strands", sample->capture->n_strands);
    cJSON_AddNumberToObject(object, "cameras", sample->n_cameras);
    api_print(ctl, object);
    cJSON_Delete(object);
    return DONE;
}

static int write_files(const struct groomctl *ctl, const struct groom_sample *sample, const char *folder)
{
    char path[4096];
    if (mkdir(folder, 0777) && errno != EEXIST) {
        fprintf(stderr, "groomctl: folder %s cannot be made: %s\n", folder, strerror(errno));
        return REFUSED;
    }
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        if (!path_of(folder, files[i].name, path, sizeof path))
            return groomctl_usage_error("sample", "the folder's name is too long");
        if (groomctl_interrupted()) {
            fprintf(stderr, "groomctl: interrupted; %s does not hold all files\n", folder);
            return INTERRUPTED;
        }
        int status = files[i].write(sample, path);
        if (status != DONE)
            return status;
        if (!ctl->json)
            printf("%s\n", path);
    }
    return ctl->json ? print_summary(ctl, sample, folder) : DONE;
}

static int is_cancelled(void *user)
{
    (void)user;
    return groomctl_interrupted();
}

int command_sample(struct groomctl *ctl, const struct arguments *arguments)
{
    const char *folder = argument(arguments, "output");
    struct groom_sample_options options;
    struct groom_sample *sample = NULL;
    static const struct groom_progress progress = {.cancelled = is_cancelled};
    struct groom_context context = {.progress = &progress};
    struct groom_diag diag = {0};
    if (!folder)
        return groomctl_usage_error("sample", "-o FOLDER is needed");
    int status = read_options(arguments, &options);
    if (status != DONE)
        return status;
    groom_status st = groom_pool_create(0, &context.pool);
    if (st == GROOM_OK)
        st = groom_sample_create(&options, &context, &sample, &diag);
    status = st == GROOM_OK ? write_files(ctl, sample, folder) : complain(st, &diag);
    groom_sample_destroy(sample);
    groom_pool_destroy(context.pool);
    return status;
}
